"""Ray marching, shared by CPU threads and CUDA.

Emission and absorption are composited front to back (paper, Eqs. 1 to 3).
Positions are in voxels, with voxel (0, 0, 0) at the origin, x first. A ray is divided into
steps from where it enters the volume, the last one ending at the exit and therefore shorter.
A sample lies at the end of each step, where VTK has its own, and counts by the step's length.
Empty-space skipping does not change the sample positions.

Arguments that a scene does not need are None: Numba compiles one version for each
combination of argument types, without the unused code.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from model.compilation import inlined
from model.rendering.raycast.batch import fetch
from model.rendering.raycast.compositing import GROUP, composite_group
from model.rendering.raycast.shading import received, reflect
from model.rendering.raycast.tables import NOTHING

VISIBLE = np.float32(1 / 255)
"""Accumulated opacity at which a ray counts as having met something visible."""

FAINT = np.float32(5e-6)
"""Weight below which a sample's light is left out: 500 of them are less than 1/255 in all."""

FULL = np.float32(0.003)
"""Weight above which a sample is always shaded itself."""

SHARED = 3
"""Fainter samples in a row that share the shading of the one before them."""

TINY, HUGE = np.float32(1e-30), np.float32(1e30)
ZERO, ONE = np.float32(0), np.float32(1)


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
    """Return the ray through the centre of a pixel.

    Parameters
    ----------
    camera : ndarray of float64, shape (24,)
        See :func:`model.rendering.raycast.camera.camera_array`.
    step : float
        World distance between samples.
    column, row : int
        Pixel, from the left and from the top.
    size : int
        Width of what is drawn, in pixels.

    Returns
    -------
    ray : Ray
        `count` is 0 for a ray that misses the volume.
    distance : float
        World distance from the eye to the end of the first whole step.
    """
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
    sx, sy, sz = _step(dx * step), _step(dy * step), _step(dz * step)
    ray = Ray(
        (
            np.float32(camera[0] + first * dx),
            np.float32(camera[1] + first * dy),
            np.float32(camera[2] + first * dz),
        ),
        (sx, sy, sz),
        (_inverse(sx), _inverse(sy), _inverse(sz)),
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
def _step(step: float) -> Any:
    return np.float32(step) if abs(step) > TINY else ZERO


@inlined
def _inverse(step: Any) -> Any:
    return ONE / step if step != ZERO else HUGE


@inlined
def skip_empty(ray: Any, k: int, cells: Any, cell_shape: Any, shift: int, margin: int = 0) -> int:
    """Return the first sample behind the empty block of cells around sample k, or k if not empty.

    Parameters
    ----------
    margin : int
        Number of cells around a visible cell that also count as visible.
    """
    t = min(np.float32(k), ray.last)
    cx = int(ray.start[0] + t * ray.step[0]) >> shift
    cy = int(ray.start[1] + t * ray.step[1]) >> shift
    cz = int(ray.start[2] + t * ray.step[2]) >> shift
    # Rounding may put a sample just outside the grid.
    cx, cy, cz = min(cx, cell_shape[0] - 1), min(cy, cell_shape[1] - 1), min(cz, cell_shape[2] - 1)
    distance = int(cells[np.uint64(cx + cell_shape[0] * (cy + cell_shape[1] * cz))]) - margin
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


@inlined
def march(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    alphas: Any,
    colors: Any,
    light: Any,
    glow: Any,
    ray: Any,
    opaque: Any,
    levels: Any,
    staging: Any,
    total: Any,
) -> int:
    """Composite the samples of one ray.

    Parameters
    ----------
    voxels : ndarray, 1-D
        x fastest.
    shape : tuple of 3 int
        Voxels along x, y and z.
    scale : tuple of 4 float32
    missing : ndarray of uint8, 1-D, or None
        See :func:`model.rendering.raycast.batch.fetch`.
    cells : ndarray of int8, 1-D
        Distance of each cell to the nearest visible one, in cells.
    cell_shape : tuple of 3 int
        Number of cells along x, y and z.
    shift : int
        Base-2 logarithm of a cell's edge in voxels.
    alphas : ndarray of float32, shape (levels,)
        Opacity of a sample at each level.
    colors : ndarray of float32, shape (4 levels,), or None
        Premultiplied RGBA of a sample at each level; None to compute opacity only.
    light : Light or None
        Parameters of gradient shading.
    glow : LightGrid or None
        Precomputed light of global lighting.
    ray : Ray
    opaque : float32
        Transparency below which the ray is terminated.
    levels : ndarray of int32, shape (n,)
    staging : Staging or None
        Scratch memory for a batch of samples; see :func:`model.rendering.raycast.batch.fetch`.
    total : ndarray of float32, shape (4,)
        Output: RGBA, premultiplied.

    Returns
    -------
    int
        The sample at which the opacity reaches :data:`VISIBLE`, or -1.
    """
    # The last sample is left to the end, as only its step has another length.
    total[0] = total[1] = total[2] = total[3] = ZERO
    through = ONE
    diffuse, gloss = ONE, ZERO
    shared = 0
    first = -1
    end = np.int32(NOTHING)
    k = 0
    while k < ray.count:
        behind = skip_empty(ray, k, cells, cell_shape, shift)
        if behind > k:
            k = behind
            shared = 0
            continue
        # A whole batch, even beyond the cell's end: partial vectors would not be faster.
        fetch(voxels, shape, scale, missing, ray, k, levels, staging)
        if ray.count - k <= len(levels):
            end = levels[ray.count - 1 - k]
            levels[ray.count - 1 - k] = np.int32(NOTHING)
        before = through
        if colors is not None and light is None and glow is None and staging is not None:
            for m in range(0, len(levels), GROUP):
                through = composite_group(colors, alphas, levels, m, total, through)
        else:
            for m in range(len(levels)):
                level = np.uint64(np.uint32(levels[m]))
                a = alphas[level]
                if colors is None:
                    total[3] += through * a
                else:
                    at = np.uint64(4) * level
                    r, g, b = colors[at], colors[at + np.uint64(1)], colors[at + np.uint64(2)]
                    if light is not None or glow is not None:
                        if through * a > FAINT:
                            if shared == 0 or through * a > FULL:
                                diffuse, gloss = shade(
                                    voxels, shape, light, glow, ray, np.float32(k + m)
                                )
                                shared = SHARED
                            else:
                                shared -= 1
                            white = gloss * a
                            r, g, b = r * diffuse + white, g * diffuse + white, b * diffuse + white
                        else:
                            r = g = b = ZERO
                    total[0] += through * r
                    total[1] += through * g
                    total[2] += through * b
                    total[3] += through * a
                through *= ONE - a
        if first < 0 and through <= ONE - VISIBLE:
            first = k + _first_visible(alphas, levels, before)
        k += len(levels)
        if through < opaque:
            break
    a = alphas[np.uint64(np.uint32(end))]
    if a > TINY and through >= opaque:
        part = through * opacity_of_part(a, ray.rest)
        total[3] += part
        if colors is not None:
            at = np.uint64(4) * np.uint64(np.uint32(end))
            if light is not None or glow is not None:
                diffuse, gloss = shade(voxels, shape, light, glow, ray, ray.last)
            for channel in range(3):
                color = colors[at + np.uint64(channel)] / a
                total[channel] += part * (diffuse * color + gloss)
        if first < 0 and through - part <= ONE - VISIBLE:
            first = ray.count - 1
    return first


@inlined
def opacity_of_part(a: Any, share: Any) -> Any:
    """Return the opacity of a fraction of a step, a being that of a whole one."""
    return -math.expm1(share * math.log1p(-a))


@inlined
def slope_of_part(a: Any, share: Any, least: Any) -> Any:
    """Return the derivative of :func:`opacity_of_part` by a.

    It diverges at a = 1; where the transparency 1 - a is below `least`, it is clamped.
    """
    return share * max(ONE - a, least) ** (share - ONE)


@inlined
def shade(voxels: Any, shape: Any, light: Any, glow: Any, ray: Any, k: Any) -> Any:
    """Return the factor of the colour of sample k, and its gloss, under the scene's light."""
    diffuse, gloss = ONE, ZERO
    t = min(k, ray.last)
    if light is not None:
        diffuse, gloss = reflect(voxels, shape, light, ray, t)
    if glow is not None:
        factor = received(glow, ray, t)
        diffuse, gloss = diffuse * factor, gloss * factor
    return diffuse, gloss


@inlined
def show(
    image: Any,
    depth: Any,
    row: int,
    column: int,
    total: Any,
    t: Any,
) -> None:
    """Write one pixel of an image, and of its depth unless that is None.

    Parameters
    ----------
    image : ndarray of float32, shape (size, size, channels)
        RGBA, or opacity only.
    depth : ndarray of float32, shape (size, size), or None
    total : ndarray of float32, shape (4,)
        RGBA.
    t : float
        World distance from the eye to the first visible sample.
    """
    channels = image.shape[2]
    for channel in range(channels):
        image[row, column, channel] = total[4 - channels + channel]
    if depth is not None:
        depth[row, column] = t


@inlined
def _first_visible(alphas: Any, levels: Any, through: Any) -> int:
    """Return the index in a batch of the sample at which opacity reaches :data:`VISIBLE`."""
    for m in range(len(levels)):
        through *= ONE - alphas[np.uint64(np.uint32(levels[m]))]
        if through <= ONE - VISIBLE:
            return m
    return len(levels) - 1
