"""The latent map: samples of codes with their TFs and their places on a plane."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from model.latent.codes import Codes, CodeSamples
from model.latent.embedding import Places
from model.latent.interpolation import (
    NEIGHBOURS,
    Blend,
    Brush,
    Cells,
    blended_code,
    cell_means,
    disc_radius,
)


@dataclass(frozen=True, eq=False)
class LatentMap:
    """Samples of codes on a plane, which new codes are placed on without moving it.

    Attributes
    ----------
    places : ndarray of float32, shape (n, 2)
    is_final : bool
        False while principal components stand for the t-SNE map.
    whole : float, optional
        Radius of the disc on the map that these samples are a part of.
    """

    samples: CodeSamples
    places: Places
    is_final: bool
    whole: float | None = None

    @property
    def codes(self) -> Codes:
        """Codes (n, d) of the samples."""
        return self.samples.codes

    def moved(self, places: Places) -> LatentMap:
        """Return the same samples at their final places."""
        return replace(self, places=places, is_final=True)

    def only(self, wanted: NDArray[np.bool_]) -> LatentMap:
        """Return some of the samples where they are."""
        if wanted.all():
            return self
        samples = replace(self.samples, codes=self.codes[wanted], tfs=self.samples.tfs[wanted])
        return replace(self, samples=samples, places=self.places[wanted], whole=self.radius)

    def cells(self, brush: Brush) -> Cells:
        """Average the samples of a rectangle in 4 x 4 cells."""
        return cell_means(self.codes, self.places, brush)

    def at(self, place: tuple[float, float], closeness: float = 1.0) -> Blend:
        """Interpolate the code of a place.

        Parameters
        ----------
        closeness : float
            How many times closer one looks than at the whole map: the disc is so much smaller.
        """
        return blended_code(self.codes, self.places, place, self.radius / max(closeness, 1.0))

    def nearest(self, code: NDArray[np.floating], count: int) -> NDArray[np.int64]:
        """Indices of the samples with the nearest codes, the nearest first.

        Distances are in standard deviations of each of the codes' numbers.
        """
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
        """Radius of the disc that is interpolated over."""
        return disc_radius(self.places) if self.whole is None else self.whole

    @cached_property
    def _deviations(self) -> NDArray[np.float32]:
        return np.maximum(self.codes.std(axis=0), 1e-6)
