"""Codes between samples of a map: means of grid cells, and Shepard interpolation.

Section 5.2 of the paper. Far from all samples, and in cells without any, there is nothing to
average; what is there instead is said.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.errors import LatentError
from model.latent.codes import Codes
from model.latent.embedding import Places

CELLS = 4
"""Cells along either side of a brushed rectangle."""

RADIUS_SHARE = 0.05
"""Radius of the disc around a place, as a fraction of the map's diagonal."""

NEIGHBOURS = 12
"""Samples that the place of a new code is taken from."""

Brush = tuple[float, float, float, float]
"""A rectangle on the map: left, lower, right and upper edge."""


@dataclass(frozen=True, eq=False)
class Cells:
    """Samples of a brushed rectangle, averaged in 4 x 4 cells; row 0 is at the top.

    Attributes
    ----------
    codes : ndarray of float32, shape (4, 4, d)
        Mean code of each cell; NaN in empty cells.
    places : ndarray of float32, shape (4, 4, 2)
        Mean place of each cell; NaN in empty cells.
    count : ndarray of int64, shape (4, 4)
        Samples in each cell.
    """

    codes: Codes
    places: Places
    count: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Blend:
    """Interpolated code of a place.

    Attributes
    ----------
    code : ndarray of float32, shape (d,)
    samples : int
        Samples within the disc; 0 where the code is the nearest sample's.
    """

    code: Codes
    samples: int


def cell_means(codes: Codes, places: Places, brush: Brush) -> Cells:
    """Average codes (n, d) and places (n, 2) in the cells of a brushed rectangle.

    Edges belong to the cell on their upper right, the rectangle's own right and upper edges to
    the last cells. A rectangle of no width or height has the samples on it in its last cells.

    Raises
    ------
    LatentError
        When the rectangle is not finite.
    """
    left, lower, right, upper = brush
    if not np.isfinite(brush).all():
        raise LatentError(f"The rectangle {brush} on the map is not finite.")
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
    """Interpolate codes at a place by Shepard's weights over the samples of a disc around it.

    The weights are exp(-d^2 / h^2) with h a third of the disc's radius, as a softmax, which
    does not underflow. Without samples in the disc the nearest one's code is returned.

    Parameters
    ----------
    codes : ndarray of float32, shape (n, d)
    places : ndarray of float32, shape (n, 2)
    radius : float
        The paper's is :func:`disc_radius`.
    """
    squares = np.square(places.astype(np.float64) - place).sum(axis=1)
    inside = np.flatnonzero(squares <= radius**2)
    if not len(inside):
        return Blend(codes[squares.argmin()], 0)
    exponents = -squares[inside] / max((radius / 3) ** 2, 1e-300)
    weights = np.exp(exponents - exponents.max())
    code = weights @ codes[inside].astype(np.float64) / weights.sum()
    return Blend(code.astype(np.float32), len(inside))


def disc_radius(places: Places) -> float:
    """Radius of the disc that is interpolated over: 5 % of the map's diagonal."""
    diagonal = np.linalg.norm(np.ptp(places.astype(np.float64), axis=0))
    return RADIUS_SHARE * float(diagonal)


def _means(values: NDArray[np.float32], cell: NDArray[np.int64], count: NDArray[np.int64]) -> Codes:
    """Mean of values (m, k) in each cell; NaN in empty ones."""
    sums = np.stack(
        [np.bincount(cell, weights=column, minlength=CELLS**2) for column in values.T], axis=1
    )
    with np.errstate(invalid="ignore"):
        return np.asarray(sums / count[:, None], dtype=np.float32)
