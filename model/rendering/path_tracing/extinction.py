"""Extinction: a volume's samples under an opacity transfer function (TF), classified for paths.

View rays have :mod:`model.rendering.raycast.classification`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from model.rendering.path_tracing.tracking import CLEAREST
from model.rendering.raycast.cells import MinMaxCells
from model.rendering.raycast.tables import LEVELS, LEVELS_PER_BIN, opacity_table
from model.scene.transfer_function import OpacityTF, Range


@dataclass(frozen=True, eq=False)
class Extinction:
    """A volume's extinction under one opacity TF.

    Attributes
    ----------
    levels : ndarray of float32, shape (LEVELS,)
        Per voxel size, at each level of scalar values.
    majorants : ndarray of float32
        Greatest extinction in each cell.
    cells : ndarray of int8
        Distance of each cell to the nearest one where something is visible.
    """

    levels: NDArray[np.float32]
    majorants: NDArray[np.float32]
    cells: NDArray[np.int8]


class ExtinctionClassifier:
    """Finds extinctions in one volume; the newest are kept."""

    def __init__(self, cells: MinMaxCells, scalar_range: Range, distance: float) -> None:
        self._cells, self._range, self._distance = cells, scalar_range, distance
        self.classified = lru_cache(maxsize=4)(self._classified)

    def _classified(self, opacity_tf: OpacityTF) -> Extinction:
        opacity = opacity_table(opacity_tf, self._range, self._distance)
        levels = -np.log1p(-np.minimum(opacity, 1 - CLEAREST)) / self._distance
        in_bin = levels[:LEVELS:LEVELS_PER_BIN]
        return Extinction(
            levels.astype(np.float32),
            self._cells.greatest(in_bin),
            self._cells.distances(_touched(in_bin)),
        )


def _touched(values: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which bins are visible, or next to a visible one: values between both are, too."""
    shown = values > 0
    wide = shown.copy()
    wide[1:] |= shown[:-1]
    wide[:-1] |= shown[1:]
    return wide
