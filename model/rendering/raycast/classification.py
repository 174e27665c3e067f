"""Classification: opacities and colours of a volume's samples under transfer functions (TFs)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from model.rendering.opacity_correction import per_sample, per_sample_derivative
from model.rendering.raycast.cells import MinMaxCells
from model.scene.mask import Mask
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range
from model.scene.volume import Volume

LEVELS_PER_BIN = 16
LEVELS = (TF_SAMPLES - 1) * LEVELS_PER_BIN + 1
"""Number of look-up table entries, several per bin of the TF; the nearest one is used."""

NOTHING = LEVELS  # an additional, transparent entry for samples beyond the end of a ray
ENTRIES = TF_SAMPLES * LEVELS_PER_BIN  # of a table: levels, and more that are transparent

FADES = 32
"""Steps in which a mask's edge fades. With a mask there is one table per step, one after another:
the first for samples that are shown entirely, the n-th for those of which n / FADES is hidden."""


def opacity_table(
    opacity_tf: OpacityTF, scalar_range: Range, sample_distance: float, mask: Mask | None
) -> NDArray[np.float32]:
    """Return a sample's opacity at each level, corrected at the bins and linear between them."""
    return level_table(per_sample(_faded(opacity_tf.sample(scalar_range), mask), sample_distance))


def level_table(bins: NDArray[np.floating]) -> NDArray[np.float32]:
    """Interpolate rows (n, 256) of values of bins at each level, one table after another."""
    first = bins.astype(np.float64)[..., None]
    within = np.arange(LEVELS_PER_BIN) / LEVELS_PER_BIN
    tables = (first + np.diff(first, axis=1, append=0) * within).reshape(-1, ENTRIES)
    tables[:, LEVELS:] = 0
    return tables.astype(np.float32).ravel()


def _faded(values: NDArray[np.floating], mask: Mask | None) -> NDArray[np.float64]:
    """Return the parts of 256 values that are left in each table of a mask, (n, 256)."""
    return np.outer(1 - np.arange(1 if mask is None else FADES) / FADES, values)


def color_table(
    color_tf: ColorTF, scalar_range: Range, opacity: NDArray[np.float32] | None = None
) -> NDArray[np.float32]:
    """Return a sample's RGBA at each level, premultiplied in each table of opacities, if given.

    It is flat: red, green, blue and opacity (else 1) of the first level, then of the next ones.
    """
    bins = np.c_[color_tf.sample(scalar_range), np.ones(TF_SAMPLES)]
    table = level_table(bins.T).reshape(4, ENTRIES).T.ravel()
    if opacity is None:
        return table
    return (np.repeat(opacity, 4).reshape(-1, len(table)) * table).ravel()


LARGEST_ERROR = 1 / 510
"""Largest error of a pixel by skipping and early termination together: half an 8-bit step."""


@dataclass(frozen=True, eq=False)
class Classification:
    """A volume's samples under one opacity TF."""

    distance: float  # between two samples of a ray, in voxels
    opacity: NDArray[np.float32]
    """Of a sample, at each level of scalar values; see :func:`opacity_table`."""
    cells: NDArray[np.int8]  # distance of each cell to the nearest one where something is visible
    brightest: float  # how bright a pixel can be, 0 to 1
    derivative: NDArray[np.float64]
    """Of a sample's opacity by the TF's, at each bin. A row (256,) for each table of opacities."""


class Classifier:
    """Classifies the samples of one volume; the newest classifications are kept."""

    def __init__(self, volume: Volume, cells: MinMaxCells, mask: Mask | None) -> None:
        self._volume, self._cells, self._mask = volume, cells, mask
        self.classified = lru_cache(maxsize=4)(self._classified)

    def _classified(
        self, opacity_tf: OpacityTF, distance: float, skip_empty: bool = True
    ) -> Classification:
        """Classify under a TF, with samples some voxels apart."""
        scalar_range = self._volume.scalar_range
        opacity = opacity_table(opacity_tf, scalar_range, distance, self._mask)
        faded = _faded(opacity_tf.sample(scalar_range), self._mask)
        return Classification(
            distance,
            opacity,
            self.cells_around(opacity, distance, skip_empty),
            self._brightest(opacity, distance),
            _faded(np.ones(TF_SAMPLES), self._mask) * per_sample_derivative(faded, distance),
        )

    def cells_around(
        self, opacity: NDArray[np.float32], distance: float, skip_empty: bool = True
    ) -> NDArray[np.int8]:
        """Return the distance of each cell to one where samples of these opacities are visible."""
        if not skip_empty:
            return np.zeros(np.prod(self._cells.shape), dtype=np.int8)
        # All skipped samples of a ray together must stay below the largest error; for a nearly
        # transparent TF, below that share of its brightest possible pixel.
        brightest = self._brightest(opacity, distance)
        least = brightest * LARGEST_ERROR / 2 / self._most_samples(distance)
        shown = opacity.reshape(-1, ENTRIES).max(axis=0) > least
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
