"""Trilinear interpolation, of the volume and of coarser grids."""

from __future__ import annotations

from typing import Any

import numpy as np

from model.rendering.raycast.compilation import inlined


@inlined
def interpolate(voxels: Any, shape: Any, x: Any, y: Any, z: Any) -> Any:
    """Interpolate at a position inside the grid, in float32.

    Parameters
    ----------
    voxels : ndarray, 1-D
        x fastest.
    shape : tuple of 3 int
        Voxels along x, y and z.
    x, y, z : float32
        0 to length - 1; rounding errors outside are extrapolated.
    """
    nx, ny = np.int64(shape[0]), np.int64(shape[1])
    i = min(np.int32(x), np.int32(shape[0] - 2))
    j = min(np.int32(y), np.int32(shape[1] - 2))
    k = min(np.int32(z), np.int32(shape[2] - 2))
    fx, fy, fz = x - np.float32(i), y - np.float32(j), z - np.float32(k)
    # Unsigned, or Numba would look for negative indices at each access.
    one = np.uint64(1)
    a = np.uint64(np.int64(i) + nx * (np.int64(j) + ny * np.int64(k)))
    b = a + np.uint64(nx)
    c = a + np.uint64(nx * ny)
    d = c + np.uint64(nx)
    v00, v01 = np.float32(voxels[a]), np.float32(voxels[a + one])
    v10, v11 = np.float32(voxels[b]), np.float32(voxels[b + one])
    w00, w01 = np.float32(voxels[c]), np.float32(voxels[c + one])
    w10, w11 = np.float32(voxels[d]), np.float32(voxels[d + one])
    v0 = v00 + fx * (v01 - v00)
    v1 = v10 + fx * (v11 - v10)
    w0 = w00 + fx * (w01 - w00)
    w1 = w10 + fx * (w11 - w10)
    v = v0 + fy * (v1 - v0)
    w = w0 + fy * (w1 - w0)
    return v + fz * (w - v)


@inlined
def interpolate_inside(voxels: Any, shape: Any, x: Any, y: Any, z: Any) -> Any:
    """Interpolate at any position; those outside take the value on the nearest face."""
    zero = np.float32(0)
    return interpolate(
        voxels,
        shape,
        min(max(x, zero), np.float32(shape[0] - 1)),
        min(max(y, zero), np.float32(shape[1] - 1)),
        min(max(z, zero), np.float32(shape[2] - 1)),
    )
