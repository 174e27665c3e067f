"""The latent map: TFs' codes on a plane, and the codes between them (paper, section 5.2)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from model.errors import LatentError
from model.latent.codes import Codes, CodeSamples
from model.latent.embedding import Places

CELLS = 4  # cells along either side of a brushed rectangle
RADIUS_SHARE = 0.05  # radius of the disc around a place, as a fraction of the map's diagonal
NEIGHBOURS = 12  # samples that determine the place of a new code
Brush = tuple[float, float, float, float]  # a rectangle: left, lower, right and upper edge


@dataclass(frozen=True, eq=False)
class Cells:
    """Samples of a brushed rectangle, averaged in 4 x 4 cells; row 0 is at the top."""

    codes: Codes  # means (4, 4, d), NaN in empty cells
    places: Places  # means (4, 4, 2), NaN in empty cells
    count: NDArray[np.int64]  # samples of each cell (4, 4)


@dataclass(frozen=True, eq=False)
class Blend:
    """Code (d,) of a place, interpolated from this many samples; 0 if it is the nearest one's."""

    code: Codes
    samples: int


def cell_means(codes: Codes, places: Places, brush: Brush) -> Cells:
    """Average codes (n, d) and places (n, 2) in the cells of a brushed rectangle."""
    left, lower, right, upper = brush
    if not np.isfinite(brush).all():
        raise LatentError(f"The rectangle {brush} on the map is not finite; give four numbers.")
    left, right = min(left, right), max(left, right)
    lower, upper = min(lower, upper), max(lower, upper)
    corner, sides = np.array([left, lower]), np.array([right - left, upper - lower])
    inside = ((places >= corner) & (places <= corner + sides)).all(axis=1)
    index = np.flatnonzero(inside)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (places[index].astype(np.float64) - corner) / sides
    share = np.nan_to_num(share, nan=1.0, posinf=1.0)
    column, row = np.minimum((share * CELLS).astype(np.int64), CELLS - 1).T
    cell = (CELLS - 1 - row) * CELLS + column
    count = np.bincount(cell, minlength=CELLS**2)
    shape = (CELLS, CELLS)
    return Cells(
        _means(codes[index], cell, count).reshape(*shape, -1),
        _means(places[index], cell, count).reshape(*shape, 2),
        count.reshape(shape),
    )


def blended_code(codes: Codes, places: Places, place: tuple[float, float], radius: float) -> Blend:
    """Interpolate codes at a place by Shepard's weights over the samples of a disc around it."""
    squares = np.square(places.astype(np.float64) - place).sum(axis=1)
    inside = np.flatnonzero(squares <= radius**2)
    if not len(inside):
        return Blend(codes[squares.argmin()], 0)
    exponents = -squares[inside] / max((radius / 3) ** 2, 1e-300)
    weights = np.exp(exponents - exponents.max())
    code = weights @ codes[inside].astype(np.float64) / weights.sum()
    return Blend(code.astype(np.float32), len(inside))


def _means(values: NDArray[np.float32], cell: NDArray[np.int64], count: NDArray[np.int64]) -> Codes:
    """Mean of values (m, k) in each cell; NaN in empty ones."""
    sums = np.stack([np.bincount(cell, column, CELLS**2) for column in values.T], axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(sums / count[:, None], dtype=np.float32)


@dataclass(frozen=True, eq=False)
class LatentMap:
    """Samples of codes on a plane; new codes are placed among them."""

    samples: CodeSamples
    places: Places  # shape (n, 2)
    is_final: bool  # False while principal components replace the t-SNE map
    whole: float | None = None  # radius of the disc on the whole map

    @property
    def codes(self) -> Codes:
        """Codes (n, d) of the samples."""
        return self.samples.codes

    def moved(self, places: Places) -> LatentMap:
        """Return the same samples at their final places."""
        return replace(self, places=places, is_final=True)

    def only(self, wanted: NDArray[np.bool_]) -> LatentMap:
        """Return some of the samples at their places."""
        if wanted.all():
            return self
        samples = replace(self.samples, codes=self.codes[wanted], tfs=self.samples.tfs[wanted])
        return replace(self, samples=samples, places=self.places[wanted], whole=self.radius)

    def cells(self, brush: Brush) -> Cells:
        """Average the samples of a rectangle in 4 x 4 cells."""
        return cell_means(self.codes, self.places, brush)

    def at(self, place: tuple[float, float], closeness: float = 1.0) -> Blend:
        """Interpolate the code of a place."""
        return blended_code(self.codes, self.places, place, self.radius / max(closeness, 1.0))

    def nearest(self, code: NDArray[np.floating], count: int) -> NDArray[np.int64]:
        """Indices of the samples with the nearest codes, the nearest first."""
        return self.distances(code).argsort(kind="stable")[:count]

    def place(self, code: NDArray[np.floating]) -> tuple[float, float]:
        """Approximate place of a code: the median of the places of its nearest neighbours."""
        x, y = np.median(self.places[self.nearest(code, NEIGHBOURS)], axis=0)
        return float(x), float(y)

    def distances(self, code: NDArray[np.floating]) -> NDArray[np.float32]:
        """Distance (n,) of every sample's code from a code, in standard deviations."""
        steps = (self.codes - np.asarray(code, dtype=np.float32)) / self._deviations
        return np.asarray(np.linalg.norm(steps, axis=1), dtype=np.float32)

    @cached_property
    def radius(self) -> float:
        """Radius of the disc for interpolation: 5 % of the map's diagonal."""
        if self.whole is not None:
            return self.whole
        return RADIUS_SHARE * float(np.linalg.norm(np.ptp(self.places.astype(np.float64), axis=0)))

    @cached_property
    def _deviations(self) -> NDArray[np.float32]:
        return np.maximum(self.codes.std(axis=0), 1e-6)
