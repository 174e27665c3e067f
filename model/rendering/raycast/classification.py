"""Classification: opacities of a volume's samples under an opacity transfer function (TF)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from model.rendering.opacity_correction import per_sample_derivative
from model.rendering.raycast.cells import MinMaxCells
from model.rendering.raycast.tables import LEVELS_PER_BIN, opacity_table
from model.scene.transfer_function import TF_SAMPLES, OpacityTF
from model.scene.volume import Volume

LARGEST_ERROR = 1 / 510
"""Largest error of a pixel by skipping and early termination together: half an 8-bit step."""


@dataclass(frozen=True, eq=False)
class Classification:
    """A volume's samples under one opacity TF.

    Attributes
    ----------
    distance : float
        Between two samples of a ray, in voxels.
    opacity : ndarray of float32, shape (LEVELS,)
        Of a sample, at each level of scalar values.
    cells : ndarray of int8
        Distance of each cell to the nearest one where something is visible.
    brightest : float
        How bright a pixel can be, 0 to 1.
    derivative : ndarray of float64, shape (256,)
        Of a sample's opacity by the TF's, at each bin.
    """

    distance: float
    opacity: NDArray[np.float32]
    cells: NDArray[np.int8]
    brightest: float
    derivative: NDArray[np.float64]


class Classifier:
    """Classifies the samples of one volume; the newest classifications are kept."""

    def __init__(self, volume: Volume, cells: MinMaxCells) -> None:
        self._volume, self._cells = volume, cells
        self.classified = lru_cache(maxsize=4)(self._classified)

    def _classified(
        self, opacity_tf: OpacityTF, distance: float, skip_empty: bool = True
    ) -> Classification:
        """Classify under a TF, with samples some voxels apart."""
        scalar_range = self._volume.scalar_range
        opacity = opacity_table(opacity_tf, scalar_range, distance)
        return Classification(
            distance,
            opacity,
            self.cells_around(opacity, distance, skip_empty),
            self._brightest(opacity, distance),
            per_sample_derivative(opacity_tf.sample(scalar_range), distance),
        )

    def cells_around(
        self, opacity: NDArray[np.float32], distance: float, skip_empty: bool = True
    ) -> NDArray[np.int8]:
        """Return the distance of each cell to one where samples of these opacities are visible."""
        if not skip_empty:
            return np.zeros(np.prod(self._cells.shape), dtype=np.int8)
        # All skipped samples of a ray together must stay below the largest error, or that share
        # of the brightest pixel that a nearly transparent TF can make.
        brightest = self._brightest(opacity, distance)
        shown = opacity > brightest * LARGEST_ERROR / 2 / self._most_samples(distance)
        in_bin = np.zeros(TF_SAMPLES, dtype=bool)
        # Levels between two bins count for both.
        level = np.flatnonzero(shown)
        in_bin[level // LEVELS_PER_BIN] = True
        in_bin[-(-level // LEVELS_PER_BIN)] = True
        return self._cells.distances(in_bin)

    def _brightest(self, opacity: NDArray[np.float32], distance: float) -> float:
        return min(1.0, self._most_samples(distance) * float(opacity.max()))

    def _most_samples(self, distance: float) -> float:
        """Most samples that a ray can have."""
        return 2 * self._volume.radius / (distance * self._volume.voxel_size)
