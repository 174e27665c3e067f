"""Rays from the camera: the part in the volume, its samples, and empty space that they skip.

Positions are in voxels, with voxel (0, 0, 0) at the origin, x first. A ray is divided into
steps from where it enters the volume, the last one ending at the exit and therefore shorter.
A sample lies at the end of each step, where VTK has its own, and counts by the step's length.
Empty-space skipping does not change the sample positions.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from model.compilation import inlined
from model.rendering.raster import Raster
from model.scene.clip_plane import WHOLE_PART, ShownPart
from model.scene.view import View
from model.scene.volume import Volume


def camera_array(
    view: View, volume: Volume, raster: Raster | None = None, part: ShownPart = WHOLE_PART
) -> NDArray[np.float64]:
    """Return the camera (34,) of a view and the pixels to draw, for :func:`make_ray`.

    In voxels, with voxel (0, 0, 0) at the origin: the eye (3), the forward direction (3), and the
    offsets to the right (3) and upper (3) edge of a square image. Then the near plane's distance in
    world units, and the square of the tangent of half the view angle. Then offset and scale of the
    pixels' places to the right (2) and upwards (2), the least (3) and greatest (3) corner of what
    is shown, and its clipping plane (4). Last the eye's own offsets (3 + 3) to these edges.

    In perspective, directions change from pixel to pixel; in orthographic views, eyes do.
    """
    right, up, back = view.basis()
    spacing = np.array(volume.spacing)
    # From the first voxel, not from the origin, which may be far away.
    eye = np.array(volume.extent) / 2 + view.eye_distance(volume.radius) * back
    angle, shift = view.tangent, 0.0
    if view.is_orthographic:
        angle, shift = 0.0, view.tangent * view.camera_distance(volume.radius)
    raster = raster or Raster(1, 1)
    # Kernels measure columns and rows in halves of the raster's width, from its upper edge.
    (x, y), (half_width, half_height) = raster.center, raster.half_size
    return np.concatenate(
        [
            eye / spacing,
            -back / spacing,
            angle * right / spacing,
            angle * up / spacing,
            [view.near_distance(volume.radius), angle**2],
            [x - view.pan_x, half_width, y + half_height - half_width - view.pan_y, half_width],
            part.corners(volume).ravel(),
            part.plane(volume),
            shift * right / spacing,
            shift * up / spacing,
        ]
    )


TINY, HUGE = np.float32(1e-30), np.float32(1e30)
ZERO, ONE = np.float32(0), np.float32(1)


class Medium(NamedTuple):
    """A volume as kernels read it, under one opacity TF."""

    voxels: Any  # array, 1-D: x fastest
    shape: Any  # tuple of 3 int: voxels along x, y and z
    scale: Any  # tuple of 2 float32: lowest scalar value, and levels per unit of scalar value
    missing: Any  # uint8, 1-D: marks of hidden voxels, see `hidden_share`; empty without any
    cells: Any  # int8, 1-D: distance of each cell to one where something is visible, in cells
    cell_shape: Any  # tuple of 3 int: cells along x, y and z
    shift: Any  # int: base-2 logarithm of a cell's edge in voxels
    alphas: Any  # float32, 1-D: opacity of a sample at each level, see `opacity_table`
    is_nearest: Any  # bool: whether samples have the nearest voxel's value, as labels do
    blur: Any  # float32: share of each of two neighbours in a normal, see `blur_of`
    smooth: Any  # float32: share of values by cubic B-spline, of close samples and of paths


class Ray(NamedTuple):
    """The part of a ray inside the volume."""

    start: Any  # tuple of 3 float32: position of the first sample
    step: Any  # tuple of 3 float32: vector from one sample to the next
    inverse: Any  # tuple of 3 float32: reciprocal of `step`; `HUGE` where that is 0
    count: Any  # int: number of samples
    last: Any  # float32: position of the last sample, in steps behind the first one
    rest: Any  # float32: length of the last step, as a fraction of the others, above 0 and up to 1


@inlined
def make_ray(camera, step, column, row, size):
    """Return the ray through the centre of a pixel."""
    x = camera[14] + camera[15] * ((2 * column + 1) / size - 1)
    y = camera[16] + camera[17] * (1 - (2 * row + 1) / size)
    unit = 1 / math.sqrt(1 + (x * x + y * y) * camera[13])
    dx = (camera[3] + x * camera[6] + y * camera[9]) * unit
    dy = (camera[4] + x * camera[7] + y * camera[10]) * unit
    dz = (camera[5] + x * camera[8] + y * camera[11]) * unit
    ex = camera[0] + x * camera[28] + y * camera[31]
    ey = camera[1] + x * camera[29] + y * camera[32]
    ez = camera[2] + x * camera[30] + y * camera[33]
    near, far = camera[12] / unit, np.inf
    near, far = _clip(ex, dx, camera[18], camera[21], near, far)
    near, far = _clip(ey, dy, camera[19], camera[22], near, far)
    near, far = _clip(ez, dz, camera[20], camera[23], near, far)
    across = camera[24] * ex + camera[25] * ey + camera[26] * ez
    along = camera[24] * dx + camera[25] * dy + camera[26] * dz
    near, far = _clip(across, along, -np.inf, camera[27], near, far)
    steps = (far - near) / step if far > near else 0.0
    count = math.ceil(steps)
    first = near + step
    sx, sy, sz = step_along(dx * step), step_along(dy * step), step_along(dz * step)
    ray = Ray(
        (np.float32(ex + first * dx), np.float32(ey + first * dy), np.float32(ez + first * dz)),
        (sx, sy, sz),
        (inverse_step(sx), inverse_step(sy), inverse_step(sz)),
        count,
        np.float32(steps - 1),
        np.float32(steps - (count - 1)),
    )
    return ray, first


@inlined
def place_on(ray, t):
    """Return the position on a ray, t steps behind the first sample."""
    return (
        ray.start[0] + t * ray.step[0],
        ray.start[1] + t * ray.step[1],
        ray.start[2] + t * ray.step[2],
    )


@inlined
def dot(a, b):
    """Return the product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def times(a, b):
    """Return the products of two vectors' components."""
    return a[0] * b[0], a[1] * b[1], a[2] * b[2]


@inlined
def _clip(eye, direction, first, last, near, far):
    """Clip a ray's interval to the slab between two opposite planes."""
    if direction == 0.0:
        # Parallel to the faces: a division would give 0 / 0 for a ray within one.
        return (near, far) if first <= eye <= last else (near, -np.inf)
    a = (first - eye) / direction
    b = (last - eye) / direction
    return max(near, min(a, b)), min(far, max(a, b))


@inlined
def step_along(step):
    """Return a step along an axis, 0 if it is too short to be divided by."""
    return np.float32(step) if abs(step) > TINY else ZERO


@inlined
def inverse_step(step):
    """Return the reciprocal of a step, :data:`HUGE` for 0."""
    return ONE / step if step != ZERO else HUGE


@inlined
def next_visible(medium, ray, k):
    """Return the first sample from k on outside empty blocks of cells; else the count or more."""
    shift, cell_shape = medium.shift, medium.cell_shape
    while k < ray.count:
        x, y, z = place_on(ray, min(np.float32(k), ray.last))
        # Rounding may put a sample just outside the grid.
        cx = min(int(x) >> shift, cell_shape[0] - 1)
        cy = min(int(y) >> shift, cell_shape[1] - 1)
        cz = min(int(z) >> shift, cell_shape[2] - 1)
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
        k = max(int(min(leave, np.float32(ray.count))), k) + 1
    return k
