"""Values for missing voxels, with which measured ones are interpolated."""

from __future__ import annotations

import itertools
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.threads import in_threads

PART = 1 << 14  # voxels that are filled at a time
LAYERS = 2  # depth of missing voxels that are filled: interpolation reads one, gradients two


def fill(voxels: NDArray[Any], missing: NDArray[np.bool_]) -> NDArray[Any]:
    """Write values like those around them to missing voxels, in place, and return the array.

    Renderers leave out samples whose nearest voxel is missing. Other samples near the border still
    interpolate missing voxels, up to :data:`LAYERS` deep for gradients. These get the mean of their
    neighbours, rounded for whole numbers, so that a number stored where nothing was measured is
    never seen. Deeper ones stay as they are, so they must hold a measured value, such as the
    lowest: estimates of noise and of the scale read all voxels. The arrays are C-contiguous.
    """
    unknown, values = missing.copy(), voxels.reshape(-1)
    for _ in range(LAYERS):
        edge = np.concatenate(in_threads(partial(_edge, unknown), range(len(unknown))))
        parts = np.array_split(edge, len(edge) // PART + 1)
        # All at once, as the means are those of the layer before.
        means = in_threads(partial(means_around, values, unknown), parts)
        values[edge] = np.concatenate(means)
        unknown.reshape(-1)[edge] = False
    return voxels


def _edge(unknown: NDArray[np.bool_], z: int) -> NDArray[np.intp]:
    """Return the places of a plane's unknown voxels that touch known ones."""
    if not unknown[z].any():
        return np.empty(0, np.intp)
    deep = np.logical_and.reduce(unknown[max(z - 1, 0) : z + 2])
    own = deep.copy()
    deep[1:] &= own[:-1]
    deep[:-1] &= own[1:]
    own = deep.copy()
    deep[:, 1:] &= own[:, :-1]
    deep[:, :-1] &= own[:, 1:]
    return np.flatnonzero(unknown[z] > deep) + z * deep.size


def means_around(
    values: NDArray[Any], unknown: NDArray[np.bool_], places: NDArray[np.intp]
) -> NDArray[Any]:
    """Return the mean of the known voxels among the 26 around each place.

    Places are numbers in the flat array of values; without a known neighbour, a mean means nothing.
    """
    total, count = np.zeros(len(places)), np.zeros(len(places), dtype=np.int64)
    _, height, width = shape = unknown.shape
    along = zip(np.unravel_index(places, shape), shape, (height * width, width, 1), strict=True)
    axes = [
        [(at * stride, (at >= 0) & (at < length)) for at in (place - 1, place, place + 1)]
        for place, length, stride in along
    ]
    for (z, in_z), (y, in_y), (x, in_x) in itertools.product(*axes):
        at = z + y + x
        counts = in_z & in_y & in_x & ~unknown.take(at, mode="clip")
        total += np.where(counts, values.take(at, mode="clip"), 0)
        count += counts
    means = total / count
    return (np.rint(means) if values.dtype.kind in "iu" else means).astype(values.dtype)
