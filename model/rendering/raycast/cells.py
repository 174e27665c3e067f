"""Min-max cells of the volume, for empty-space skipping."""

from __future__ import annotations

from concurrent.futures import Executor
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_cdt

from model.scene.transfer_function import TF_SAMPLES

SHIFT = 3  # base-2 logarithm of a cell's edge in voxels: cells of 8 x 8 x 8
FARTHEST = 127  # largest distance stored, in cells; larger ones are clipped to it

ROUNDING = 3e-6
"""Relative error allowed for interpolation in float32, by which it may exceed the voxels."""


class MinMaxCells:
    """The lowest and highest TF bin in each cell of 8 x 8 x 8 voxels.

    Voxels beyond the scalar range count for the bins at its ends.
    """

    def __init__(
        self,
        scalars: NDArray[Any],
        scale: tuple[float, float],
        executor: Executor,
        missing: NDArray[np.bool_] | None = None,
    ) -> None:
        # Adjacent cells share the voxels of their common face, which interpolation in both reads.
        self._shape = tuple((n - 2 >> SHIFT) + 1 for n in scalars.shape)
        self._bins = np.empty((*self._shape, 2), dtype=np.uint8)

        def read_layer(layer: int) -> None:
            _read_layer(scalars, scale, layer, self._bins[layer])
            if missing is not None:
                _leave_out(missing, layer, self._bins[layer])

        list(executor.map(read_layer, range(self._shape[0])))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of cells along x, y and z."""
        nz, ny, nx = self._shape
        return nx, ny, nz

    def distances(self, shown: NDArray[np.bool_]) -> NDArray[np.int8]:
        """Chessboard distance of each cell to the nearest visible cell."""
        total = np.concatenate([[0], np.cumsum(shown)])
        occupied = total[self._bins[..., 1].astype(np.intp) + 1] > total[self._bins[..., 0]]
        return distances_to(occupied)

    def greatest(self, values: NDArray[np.floating]) -> NDArray[np.float32]:
        """Greatest value of the bins in each cell."""
        first, last = self._bins[..., 0].ravel(), self._bins[..., 1].ravel()
        # Greatest value from each bin to each later one: few numbers, whatever the volume is.
        table = np.zeros((TF_SAMPLES, TF_SAMPLES), dtype=np.float32)
        for bin_ in range(TF_SAMPLES):
            table[bin_, bin_:] = np.maximum.accumulate(values[bin_:])
        return np.asarray(table[first, last])


def distances_to(occupied: NDArray[np.bool_]) -> NDArray[np.int8]:
    """Chessboard distance of each cell (nz, ny, nx) to the nearest occupied one."""
    if not occupied.any():
        return np.full(occupied.size, FARTHEST, dtype=np.int8)
    distance = distance_transform_cdt(~occupied, "chessboard")
    return np.minimum(distance, FARTHEST).astype(np.int8).ravel()


def _read_layer(
    scalars: NDArray[Any], scale: tuple[float, float], layer: int, bins: NDArray[np.uint8]
) -> None:
    """Compute the lowest and highest TF bin in each cell of a layer."""
    low, high = _ends(scalars, layer)
    offset, factor = scale
    first = (low.astype(np.float64) - offset) * factor
    last = (high.astype(np.float64) - offset) * factor
    # Slightly wider: interpolation in float32 may exceed either end, the more, the
    # farther voxels lie from each other, which may be well beyond the scalar range.
    excess = np.maximum(1e-3, ROUNDING * (last - first))
    bins[..., 0] = np.clip(np.floor(first - excess), 0, TF_SAMPLES - 1)
    bins[..., 1] = np.clip(np.ceil(last + excess), 0, TF_SAMPLES - 1)


def _leave_out(missing: NDArray[np.bool_], layer: int, bins: NDArray[np.uint8]) -> None:
    """Mark the cells of a layer in which all voxels are missing by a last bin before the first."""
    is_empty, _ = _ends(missing, layer)
    bins[is_empty] = TF_SAMPLES - 1, 0


def _ends(voxels: NDArray[Any], layer: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the least and the greatest voxel of each cell of a layer; they share faces."""
    planes = voxels[layer << SHIFT : (layer + 1 << SHIFT) + 1]
    low, high = np.asarray(planes.min(axis=0)), np.asarray(planes.max(axis=0))
    for axis, count in enumerate(low.shape):
        firsts = np.arange(0, count - 1, 1 << SHIFT)
        faces = np.minimum(firsts + (1 << SHIFT), count - 1)
        low = np.minimum(np.minimum.reduceat(low, firsts, axis), low.take(faces, axis))
        high = np.maximum(np.maximum.reduceat(high, firsts, axis), high.take(faces, axis))
    return low, high
