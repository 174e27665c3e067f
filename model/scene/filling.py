"""Values for missing voxels, with which measured ones are interpolated."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.threads import in_threads

LAYERS = 2  # depth of missing voxels that are filled: interpolation reads one, gradients two


def filled(voxels: NDArray[Any], missing: NDArray[np.bool_], elsewhere: float) -> NDArray[Any]:
    """Return a copy with missing voxels replaced by values like those around them.

    Renderers leave out samples whose nearest voxel is missing. Other samples near the border still
    interpolate missing voxels, up to :data:`LAYERS` deep for gradients. These get the mean of their
    neighbours, rounded for whole numbers, so that a number stored where nothing was measured is
    never seen. Deeper ones get `elsewhere`, which the voxels' type must hold.
    """
    values, known, places = np.empty(voxels.shape, voxels.dtype), ~missing, range(len(voxels))

    def begin(z: int) -> None:
        values[z] = np.where(missing[z], voxels.dtype.type(elsewhere), voxels[z])

    in_threads(begin, places)
    for _ in range(LAYERS):
        # All at once: the means are those of the layer before.
        found = in_threads(lambda z: _means(values, known, z), places)
        for z, (edge, means) in enumerate(found):
            values[z][edge] = means
            known[z][edge] = True
    return values


def _means(
    values: NDArray[Any], known: NDArray[np.bool_], z: int
) -> tuple[tuple[NDArray[np.intp], ...], NDArray[Any]]:
    """Find a plane's unknown voxels that touch known ones, and the mean of those in 26."""
    near = slice(max(z - 1, 0), z + 2)
    if known[z].all() or not known[near].any():
        return (np.empty(0, np.intp),) * 2, np.empty(0, values.dtype)
    there = np.pad(known[near], ((0, 0), (1, 1), (1, 1)))
    rows = np.logical_or.reduce(there)
    rows = rows[:-2] | rows[1:-1] | rows[2:]
    y, x = np.nonzero((rows[:, :-2] | rows[:, 1:-1] | rows[:, 2:]) & ~known[z])
    total, count = np.zeros(len(y)), np.zeros(len(y), dtype=np.int64)
    for (plane, is_known), dy, dx in itertools.product(
        zip(values[near], there, strict=True), (-1, 0, 1), (-1, 0, 1)
    ):
        counts = is_known[y + dy + 1, x + dx + 1]
        total += np.where(counts, plane.take((y + dy) * plane.shape[1] + x + dx, mode="clip"), 0)
        count += counts
    means = total / count
    return (y, x), (np.rint(means) if values.dtype.kind in "iu" else means).astype(values.dtype)
