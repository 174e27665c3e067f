"""Values for voxels of which nothing is known, so that interpolation next to them is right.

Renderers leave out every sample whose nearest voxel is missing. What lies nearer to a measured
one is interpolated, and its gradient taken, with voxels up to two farther away: these get the
mean of their neighbours, so that what is stored in a file where nothing was measured appears
nowhere.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray

LAYERS = 2
"""How many voxels deep missing ones are filled: interpolation reads one, gradients two."""


def filled(voxels: NDArray[Any], missing: NDArray[np.bool_], elsewhere: float) -> NDArray[Any]:
    """Return a copy with missing voxels replaced by values like those around them.

    Parameters
    ----------
    voxels : ndarray, shape (nz, ny, nx)
    missing : ndarray of bool, shape (nz, ny, nx)
    elsewhere : float
        Value of missing voxels farther than :data:`LAYERS` from all others; one that the
        voxels' type holds.

    Returns
    -------
    ndarray, shape (nz, ny, nx)
        Of the voxels' type: means of whole numbers are rounded.
    """
    values = np.where(missing, voxels.dtype.type(elsewhere), voxels)
    known = ~missing
    for _ in range(LAYERS):
        edge = _widened(known) & ~known
        means = [_means(values, known, edge[z], z) for z in range(len(values))]
        # All at once: the means are those of the layer before.
        for plane, inside, mean in zip(values, edge, means, strict=True):
            plane[inside] = mean
        known |= edge
    return values


def _means(
    values: NDArray[Any], known: NDArray[np.bool_], edge: NDArray[np.bool_], z: int
) -> NDArray[Any]:
    """Mean of the known ones of the 26 neighbours of some voxels of a plane."""
    y, x = np.nonzero(edge)
    total, count = np.zeros(len(y)), np.zeros(len(y), dtype=np.int64)
    nz, ny, nx = values.shape
    for dz, dy, dx in itertools.product((-1, 0, 1), repeat=3):
        k, j, i = z + dz, y + dy, x + dx
        if not 0 <= k < nz:
            continue
        inside = (j >= 0) & (j < ny) & (i >= 0) & (i < nx)
        inside[inside] = known[k, j[inside], i[inside]]
        total[inside] += values[k, j[inside], i[inside]]
        count += inside
    mean = total / count
    return (np.rint(mean) if values.dtype.kind in "iu" else mean).astype(values.dtype)


def _widened(known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which voxels are known or have a known one among their 26 neighbours."""
    wide = known.copy()
    for axis in range(3):
        narrow = np.moveaxis(wide.copy(), axis, 0)
        along = np.moveaxis(wide, axis, 0)
        along[1:] |= narrow[:-1]
        along[:-1] |= narrow[1:]
    return wide
