"""Cells of a coarse volume, for empty-space skipping."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from model.networks.refined.coarse_kernels import ENTRIES, LEVELS, SUBLEVELS
from model.networks.refined.coarse_volume import SPREADS, CoarseVolume
from model.rendering.raycast.cells import distances_to

SHIFT = 3
"""Base-2 logarithm of a cell's edge, in nodes."""


class CoarseCells:
    """Lowest and highest mean, and widest spread, of each cell of 8 x 8 x 8 nodes.

    Parameters
    ----------
    coarse : CoarseVolume
    invisible : float
        Largest opacity of a sample that may be skipped.
    """

    def __init__(self, coarse: CoarseVolume, invisible: float) -> None:
        self._invisible = invisible
        self._low = _reduced(coarse.means, minimum_filter) * SUBLEVELS
        self._high = _reduced(coarse.means, maximum_filter) * SUBLEVELS
        self._widest = _reduced(coarse.spreads, maximum_filter)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of cells along x, y and z."""
        nz, ny, nx = self._low.shape
        return nx, ny, nz

    def distances(self, opacities: NDArray[np.float32]) -> NDArray[np.int8]:
        """Distance of each cell to the nearest visible one.

        Parameters
        ----------
        opacities : ndarray of float32, shape (ENTRIES + 1,)
            Of a sample at each entry of a table.

        Returns
        -------
        ndarray of int8, 1-D, x fastest
            As :meth:`model.rendering.raycast.cells.MinMaxCells.distances`.
        """
        shown = (opacities[:ENTRIES] > self._invisible).reshape(SPREADS, LEVELS)
        # A cell may hold any spread up to its widest.
        shown = np.logical_or.accumulate(shown, axis=0)
        total = np.pad(shown.cumsum(axis=1, dtype=np.int32), ((0, 0), (1, 0)))
        occupied = total[self._widest, self._high + 1] > total[self._widest, self._low]
        return distances_to(occupied)


def _reduced(
    values: NDArray[np.uint8], function: Callable[..., NDArray[np.uint8]]
) -> NDArray[np.intp]:
    """Reduce the nodes of each cell, those of its far faces included, to one value."""
    edge = 1 << SHIFT
    # The filter's window is centred, unless it is shifted: then it starts at the cell's corner.
    reduced = function(values, edge + 1, mode="nearest", origin=-(edge // 2))
    cells = tuple(slice(0, max(n - 1, 1), edge) for n in values.shape)
    return reduced[cells].astype(np.intp)
