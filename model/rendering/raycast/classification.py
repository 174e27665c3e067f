"""Classification: opacities and colours of a volume's samples under transfer functions (TFs)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from model.rendering.opacity_correction import per_sample, per_sample_derivative
from model.rendering.raycast.cells import MinMaxCells
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range
from model.scene.volume import Volume

LEVELS_PER_BIN = 16
LEVELS = (TF_SAMPLES - 1) * LEVELS_PER_BIN + 1
"""Number of look-up table entries, several per bin of the TF; the nearest one is used."""

NOTHING = LEVELS  # an additional, transparent entry for samples beyond the end of a ray


def opacity_table(
    opacity_tf: OpacityTF, scalar_range: Range, sample_distance: float
) -> NDArray[np.float32]:
    """Return a sample's opacity at each level, corrected at the bins and linear between them."""
    return level_table(per_sample(opacity_tf.sample(scalar_range), sample_distance))


def level_table(bins: NDArray[np.floating]) -> NDArray[np.float32]:
    """Interpolate values of 256 bins at each level, shape (LEVELS + 1,); 0 for :data:`NOTHING`."""
    table = np.zeros(LEVELS + 1, dtype=np.float32)
    table[:LEVELS] = np.interp(_levels(), np.arange(TF_SAMPLES), bins)
    return table


def color_table(
    color_tf: ColorTF, scalar_range: Range, opacity: NDArray[np.float32] | None = None
) -> NDArray[np.float32]:
    """Return a sample's RGBA at each level, premultiplied if its opacity is given.

    It is flat: red, green, blue and opacity (else 1) of the first level, then of the next ones.
    """
    bins = color_tf.sample(scalar_range)
    levels, every = _levels(), np.arange(TF_SAMPLES)
    table = np.zeros((LEVELS + 1, 4), dtype=np.float32)
    for channel in range(3):
        table[:LEVELS, channel] = np.interp(levels, every, bins[:, channel])
    table[:LEVELS, 3] = 1
    if opacity is not None:
        table *= opacity[:, None]
    return table.ravel()


def _levels() -> NDArray[np.float64]:
    """Positions of the levels, in TF bins."""
    return np.linspace(0, TF_SAMPLES - 1, LEVELS)


LARGEST_ERROR = 1 / 510
"""Largest error of a pixel by skipping and early termination together: half an 8-bit step."""


@dataclass(frozen=True, eq=False)
class Classification:
    """A volume's samples under one opacity TF."""

    distance: float  # between two samples of a ray, in voxels
    opacity: NDArray[np.float32]
    """Of a sample, at each level of scalar values. Shape (LEVELS,)."""
    cells: NDArray[np.int8]  # distance of each cell to the nearest one where something is visible
    brightest: float  # how bright a pixel can be, 0 to 1
    derivative: NDArray[np.float64]
    """Of a sample's opacity by the TF's, at each bin. Shape (256,)."""


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
