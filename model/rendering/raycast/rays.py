"""Rays: the part of each inside the volume, its samples, and the empty space that they skip.

Positions are in voxels, with voxel (0, 0, 0) at the origin, x first. A ray is divided into
steps from where it enters the volume, the last one ending at the exit and therefore shorter.
A sample lies at the end of each step, where VTK has its own, and counts by the step's length.
Empty-space skipping does not change the sample positions.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from model.compilation import inlined

TINY, HUGE = np.float32(1e-30), np.float32(1e30)
ZERO, ONE = np.float32(0), np.float32(1)


class Medium(NamedTuple):
    """A volume as kernels read it, under one opacity TF.

    Attributes
    ----------
    voxels : ndarray, 1-D
        x fastest.
    shape : tuple of 3 int
        Voxels along x, y and z.
    scale : tuple of 2 float32
        Lowest scalar value, and levels of the tables per unit of scalar value.
    missing : ndarray of uint8, 1-D
        Not 0 for voxels that are transparent under any TF; empty where there are none.
    cells : ndarray of int8, 1-D
        Distance of each cell to the nearest one where something is visible, in cells.
    cell_shape : tuple of 3 int
        Cells along x, y and z.
    shift : int
        Base-2 logarithm of a cell's edge in voxels.
    alphas : ndarray of float32, shape (levels,)
        Opacity of a sample at each level.
    is_nearest : bool
        Whether samples have the value of the nearest voxel, as labels have nothing in between.
    """

    voxels: Any
    shape: Any
    scale: Any
    missing: Any
    cells: Any
    cell_shape: Any
    shift: Any
    alphas: Any
    is_nearest: Any


class Ray(NamedTuple):
    """The part of a ray inside the volume.

    Attributes
    ----------
    start : tuple of 3 float32
        Position of the first sample.
    step : tuple of 3 float32
        Vector from one sample to the next.
    inverse : tuple of 3 float32
        Reciprocal of `step`; :data:`HUGE` where that is 0.
    count : int
        Number of samples.
    last : float32
        Position of the last sample, in steps behind the first one.
    rest : float32
        Length of the last step, as a fraction of the others, above 0 and up to 1.
    """

    start: Any
    step: Any
    inverse: Any
    count: Any
    last: Any
    rest: Any


@inlined
def make_ray(camera: Any, step: float, column: int, row: int, size: int) -> Any:
    """Return the ray through the centre of a pixel."""
    x = camera[14] + camera[15] * ((2 * column + 1) / size - 1)
    y = camera[16] + camera[17] * (1 - (2 * row + 1) / size)
    unit = 1 / math.sqrt(1 + (x * x + y * y) * camera[13])
    dx = (camera[3] + x * camera[6] + y * camera[9]) * unit
    dy = (camera[4] + x * camera[7] + y * camera[10]) * unit
    dz = (camera[5] + x * camera[8] + y * camera[11]) * unit
    near, far = camera[12] / unit, np.inf
    near, far = _clip(camera[0], dx, camera[18], camera[21], near, far)
    near, far = _clip(camera[1], dy, camera[19], camera[22], near, far)
    near, far = _clip(camera[2], dz, camera[20], camera[23], near, far)
    steps = (far - near) / step if far > near else 0.0
    count = math.ceil(steps)
    first = near + step
    sx, sy, sz = step_along(dx * step), step_along(dy * step), step_along(dz * step)
    ray = Ray(
        (
            np.float32(camera[0] + first * dx),
            np.float32(camera[1] + first * dy),
            np.float32(camera[2] + first * dz),
        ),
        (sx, sy, sz),
        (inverse_step(sx), inverse_step(sy), inverse_step(sz)),
        count,
        np.float32(steps - 1),
        np.float32(steps - (count - 1)),
    )
    return ray, first


@inlined
def _clip(eye: float, direction: float, first: float, last: float, near: float, far: float) -> Any:
    """Clip a ray's interval to the slab between two opposite planes."""
    if direction == 0.0:
        # Parallel to the faces: a division would give 0 / 0 for a ray within one.
        return (near, far) if first <= eye <= last else (near, -np.inf)
    a = (first - eye) / direction
    b = (last - eye) / direction
    return max(near, min(a, b)), min(far, max(a, b))


@inlined
def step_along(step: float) -> Any:
    """Return a step along an axis, 0 if it is too short to be divided by."""
    return np.float32(step) if abs(step) > TINY else ZERO


@inlined
def inverse_step(step: Any) -> Any:
    """Return the reciprocal of a step, :data:`HUGE` for 0."""
    return ONE / step if step != ZERO else HUGE


@inlined
def skip_empty(medium: Any, ray: Any, k: int) -> int:
    """Return the first sample behind the empty block of cells around sample k, or k if none is."""
    t = min(np.float32(k), ray.last)
    shift, cell_shape = medium.shift, medium.cell_shape
    cx = int(ray.start[0] + t * ray.step[0]) >> shift
    cy = int(ray.start[1] + t * ray.step[1]) >> shift
    cz = int(ray.start[2] + t * ray.step[2]) >> shift
    # Rounding may put a sample just outside the grid.
    cx, cy, cz = min(cx, cell_shape[0] - 1), min(cy, cell_shape[1] - 1), min(cz, cell_shape[2] - 1)
    distance = int(medium.cells[np.uint64(cx + cell_shape[0] * (cy + cell_shape[1] * cz))])
    if distance <= 0:
        return k
    x = np.float32(((cx + distance) if ray.step[0] >= ZERO else (cx - distance + 1)) << shift)
    y = np.float32(((cy + distance) if ray.step[1] >= ZERO else (cy - distance + 1)) << shift)
    z = np.float32(((cz + distance) if ray.step[2] >= ZERO else (cz - distance + 1)) << shift)
    leave = min(
        (x - ray.start[0]) * ray.inverse[0],
        (y - ray.start[1]) * ray.inverse[1],
        (z - ray.start[2]) * ray.inverse[2],
    )
    # Advance by at least one sample in spite of rounding.
    return max(int(min(leave, np.float32(ray.count))), k) + 1
