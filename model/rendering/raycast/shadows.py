"""Shadows: one ray towards the light from each sample, as VTK's volumetric scattering casts it.

In texture coordinates, which go from 0 to 1 along each axis whatever the volume's sides are, with h
the length of a view step there and L the direction towards the light, of length 1:

- what arrives at t is the product of 1 - a(t + k h L) over k = 1, 2, ... up to the volume's end or
  the reach; all of it within a step of the end;
- a sample of opacity a and gradient g, in ranges per voxel size, has 1 - exp(-|g| a) of gradient
  shading, and for the rest what arrives.

What a crop box leaves out casts shadows, too. How far they reach, how long a step is and how strong
the shading is depend on the shape of the volume: VTK's light does.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from model.compilation import inlined
from model.rendering.raycast.batch import HALF, fetch
from model.rendering.raycast.illumination import DIFFUSE, travel_direction
from model.rendering.raycast.rays import ONE, ZERO, Ray, inverse_step, skip_empty, step_along
from model.scene.light import LightDirection
from model.scene.view import View
from model.scene.volume import Volume

REACH = 0.5
"""Of shadow rays, as VTK counts it: 1 is all of the volume."""

DARK = np.float32(1e-3)
"""Light below which nothing more is looked for: an eighth of an 8-bit step."""


APART = 4
"""Samples of a view ray between those whose light is looked for first; a power of 2."""

ALIKE = np.float32(0.03)
"""Difference of light between two samples up to which those between them have their share of it.

Up to twice as much, it counts in part, so that images do not jump where it is passed."""

FAINT = np.float32(0.04)
"""Opacity of a sample up to which its light may come from its neighbours'; see :data:`ALIKE`."""

UNKNOWN = np.float32(-1)

TWO = np.float32(2)


class Shadows(NamedTuple):
    """Parameters of shadow rays.

    Attributes
    ----------
    towards : tuple of 3 float64
        Direction towards the light in voxels, of length 1 in texture coordinates.
    reach : float
        Longest shadow ray in texture coordinates.
    sharpness : float32
        Factor of the gradient, in scalar values per world length, in the shading's share.
    diffuse : float32
    """

    towards: Any
    reach: Any
    sharpness: Any
    diffuse: Any


def shadow_rays(
    view: View, light: LightDirection, volume: Volume, step: float, values: tuple[float, float]
) -> Shadows:
    """Return the parameters of shadow rays for a view and its light.

    Parameters
    ----------
    view, light, volume
    step : float
        World distance between samples.
    values : tuple of float
        Lowest and highest scalar value of the voxels.
    """
    extent = np.array(volume.extent)
    towards = -travel_direction(view, light) / extent
    towards *= np.array(volume.dimensions) / np.linalg.norm(towards)
    diagonal = math.sqrt(3)
    shortest = step / extent.max()
    reach = diagonal - (diagonal - shortest) * (1 - REACH) ** 0.33
    return Shadows(
        tuple(map(float, towards)),
        float(reach),
        np.float32(volume.voxel_size / (values[1] - values[0])),
        np.float32(DIFFUSE),
    )


@inlined
def step_length(shape: Any, ray: Any) -> Any:
    """Return the length of a ray's step in texture coordinates."""
    x, y, z = ray.step[0] / shape[0], ray.step[1] / shape[1], ray.step[2] / shape[2]
    return math.sqrt(x * x + y * y + z * z)


@inlined
def shadow_ray(shape: Any, shadows: Any, ray: Any, k: Any) -> Any:
    """Return the ray towards the light from sample k of a view ray; of no samples in the open."""
    h = step_length(shape, ray)
    t = min(k, ray.last)
    sx = step_along(h * shadows.towards[0])
    sy = step_along(h * shadows.towards[1])
    sz = step_along(h * shadows.towards[2])
    x = ray.start[0] + t * ray.step[0] + sx
    y = ray.start[1] + t * ray.step[1] + sy
    z = ray.start[2] + t * ray.step[2] + sz
    ix, iy, iz = inverse_step(sx), inverse_step(sy), inverse_step(sz)
    end = min(_ahead(x, ix, shape[0]), min(_ahead(y, iy, shape[1]), _ahead(z, iz, shape[2])))
    count = 0
    if end >= ONE:
        count = math.ceil(min(end, np.float32(shadows.reach / h)))
    return Ray((x, y, z), (sx, sy, sz), (ix, iy, iz), count, np.float32(count - 1), ONE)


@inlined
def light_arriving(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    alphas: Any,
    shadows: Any,
    ray: Any,
    k: Any,
    levels: Any,
    staging: Any,
) -> Any:
    """Return the share of the light that arrives at sample k of a view ray, 0 to 1.

    Parameters are those of :func:`model.rendering.raycast.marching.march`; `levels` and
    `staging` are scratch memory here.
    """
    towards = shadow_ray(shape, shadows, ray, k)
    through = ONE
    j = 0
    while j < towards.count:
        behind = skip_empty(towards, j, cells, cell_shape, shift)
        if behind > j:
            j = behind
            continue
        fetch(voxels, shape, scale, missing, towards, j, levels, staging, True)
        for m in range(len(levels)):
            through *= ONE - alphas[np.uint64(np.uint32(levels[m]))]
        j += len(levels)
        if through < DARK:
            break
    return through


@inlined
def sought(known: Any, m: int, a: Any) -> Any:
    """Return the sample of a batch whose light is needed next, or -1; then, the light of sample m.

    Parameters
    ----------
    known : ndarray of float32
        Light that arrives at the samples of a batch and at the next, or :data:`UNKNOWN`.
    """
    value, rest = ZERO, ONE
    low = m - m % APART
    high = low + APART
    if m == low or a >= FAINT + FAINT:
        return (m if known[m] < ZERO else -1), known[m]
    if known[low] < ZERO:
        return low, ZERO
    while True:
        if known[high] < ZERO:
            return high, ZERO
        if m == high:
            return -1, value + rest * known[high]
        change = known[high] - known[low]
        between = known[low] + change * np.float32(m - low) / np.float32(high - low)
        counts, _, _ = fading(change, a)
        value += rest * (ONE - counts) * between
        rest *= counts
        if rest == ZERO:
            return -1, value
        middle = (low + high) // 2
        if known[middle] < ZERO:
            return middle, ZERO
        if m == middle:
            return -1, value + rest * known[middle]
        if m < middle:
            high = middle
        else:
            low = middle


@inlined
def fading(change: Any, a: Any) -> Any:
    """Return how much more light is looked for between two samples, 0 to 1, and its derivatives.

    Parameters
    ----------
    change : float32
        Difference of their light.
    a : float32
        Opacity of the sample between them whose light is needed.

    Returns
    -------
    counts, by_change, by_opacity : float32
    """
    by_change, by_opacity = ZERO, ZERO
    differ, visible = abs(change) / ALIKE, a / FAINT
    strength = max(differ, visible)
    if ONE < strength < TWO:
        if differ > visible:
            by_change = (ONE if change > ZERO else -ONE) / ALIKE
        else:
            by_opacity = ONE / FAINT
    return min(max(strength - ONE, ZERO), ONE), by_change, by_opacity


@inlined
def _ahead(place: Any, inverse: Any, count: int) -> Any:
    """Return the steps from a place to the face ahead, half a voxel beyond the outermost one."""
    face = np.float32(count) - HALF if inverse > ZERO else -HALF
    return (face - place) * inverse
