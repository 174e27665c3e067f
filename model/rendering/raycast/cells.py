"""Min-max cells: where the volume has nothing that a transfer function shows."""

from __future__ import annotations

from concurrent.futures import Executor
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt

from model.compilation import compiled
from model.scene.transfer_function import TF_SAMPLES

SHIFT = 3
"""Logarithm of a cell's edge in voxels: cells of 8 x 8 x 8."""

FARTHEST = 127
"""Largest distance that is told apart, in cells."""


class MinMaxCells:
    """The lowest and highest TF bin in each cell of 8 x 8 x 8 voxels.

    Parameters
    ----------
    scalars : ndarray, shape (nz, ny, nx)
    scale : tuple of float
        Lowest scalar value, and TF bins per unit of value.
    executor : Executor
        Whose threads read the volume.
    """

    def __init__(
        self, scalars: NDArray[Any], scale: tuple[float, float], executor: Executor
    ) -> None:
        # Neighbouring cells share the voxels on their common face: interpolation reads both.
        self._shape = tuple((n - 2 >> SHIFT) + 1 for n in scalars.shape)
        self._bins = np.empty((*self._shape, 2), dtype=np.uint8)

        def read_layer(layer: int) -> None:
            _read_layer(scalars, scale, layer, self._bins[layer])

        list(executor.map(read_layer, range(self._shape[0])))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of cells along x, y and z."""
        nz, ny, nx = self._shape
        return nx, ny, nz

    @property
    def nbytes(self) -> int:
        """Memory of the cells and of one field of distances, in bytes."""
        return self._bins.nbytes + self._bins.nbytes // 2

    def distances(self, shown: NDArray[np.bool_]) -> NDArray[np.int8]:
        """Distance of each cell to the nearest one that shows something.

        Parameters
        ----------
        shown : ndarray of bool, shape (256,)
            Whether the TF shows anything in a bin.

        Returns
        -------
        ndarray of int8, 1-D, x fastest
            In cells, diagonals counting 1: 0 for a cell that shows something,
            d for one around which a block of 2 d - 1 cells is empty.
        """
        total = np.concatenate([[0], np.cumsum(shown)])
        occupied = total[self._bins[..., 1].astype(np.intp) + 1] > total[self._bins[..., 0]]
        if not occupied.any():
            return np.full(occupied.size, FARTHEST, dtype=np.int8)
        distance = distance_transform_cdt(~occupied, "chessboard")
        return np.minimum(distance, FARTHEST).astype(np.int8).ravel()


@compiled
def _read_layer(scalars: Any, scale: tuple[float, float], layer: int, bins: Any) -> None:
    """Bins of one layer of cells: the lowest that interpolation reaches, and the highest."""
    edge = 1 << SHIFT
    offset, factor = scale
    planes = range(layer * edge, min(layer * edge + edge + 1, scalars.shape[0]))
    for j in range(bins.shape[0]):
        rows = range(j * edge, min(j * edge + edge + 1, scalars.shape[1]))
        for i in range(bins.shape[1]):
            low = high = scalars[layer * edge, j * edge, i * edge]
            for z in planes:
                for y in rows:
                    for x in range(i * edge, min(i * edge + edge + 1, scalars.shape[2])):
                        low = min(low, scalars[z, y, x])
                        high = max(high, scalars[z, y, x])
            first = (float(low) - offset) * factor
            last = (float(high) - offset) * factor
            # A little wider: interpolation in float32 may step over either end.
            bins[j, i, 0] = max(int(np.floor(first - 1e-3)), 0)
            bins[j, i, 1] = min(int(np.ceil(last + 1e-3)), TF_SAMPLES - 1)
