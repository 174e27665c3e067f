"""Derivatives of image regions' energy by the opacity of samples at each bin of the TF.

A pixel is composited from samples front to back, with transparency T_i in
front of sample i and colour B_{i+1} composited behind it:

    d I / d alpha_i = T_i (c_i - B_{i+1}).

B is computed back to front. There is no division by 1 - alpha_i, so that the
derivative also holds at opaque samples. Transparent samples are included, since an
edit may make them visible. Under direct light c_i is the colour under that light, which
does not depend on the TF.

In shadows it does, by the sample's own opacity, which decides how much of its light is scattered,
and by the light that other samples take away. The latter is collected along the view ray, as the
pixel's derivative by the light that arrives at some of its samples, and taken back to the samples
of the shadow rays from there. In soft light, it is added up at the nodes of the light's grid, and
taken back from there for all pixels at once, by the sweeps' adjoint.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from model.compilation import compiled, inlined
from model.rendering.raycast.batch import fetch, stack_batch
from model.rendering.raycast.marching import FAINT, opacity_of_part, shade, slope_of_part
from model.rendering.raycast.rays import ONE, ZERO, make_ray, skip_empty
from model.rendering.raycast.shading import corner_of, light_place
from model.rendering.raycast.shadow_derivatives import (
    SPAN,
    light_at,
    pass_back,
    shade_with_slopes,
    take_light,
)
from model.rendering.raycast.shadows import UNKNOWN
from model.rendering.raycast.tables import LEVELS_PER_BIN, NOTHING
from model.scene.transfer_function import TF_SAMPLES

NEGLIGIBLE = np.float32(1e-6)
"""Transparency below which further samples are neglected."""

NEGLIGIBLE_LIT = np.float32(2e-4)
"""The same in shadows, where a sample costs more."""

FAINT_BEAM = np.float32(3e-4)
"""Share of a pixel's derivative by light, below which that of one sample is neglected."""


class Path(NamedTuple):
    """What is kept of a view ray's samples, to be traversed back to front.

    Attributes
    ----------
    levels : ndarray of int32, shape (n,)
    clear : ndarray of float32, shape (n,)
        Transparency in front of each sample.
    colors : ndarray of float32, shape (n, 3)
        Lit, not premultiplied.
    turns : ndarray of float32, shape (n, 3)
        In shadows, the derivative of the colour by the sample's opacity, times that opacity.
    known : ndarray of float32, shape (n,)
        In shadows, the light that arrives at some samples.
    beams : ndarray of float32, shape (n, 3)
        In shadows and soft light, the derivative of the pixel by the light of samples.
    shadow : ndarray of int32, shape (n,)
        Scratch memory for levels along a shadow ray.
    """

    levels: Any
    clear: Any
    colors: Any
    turns: Any
    known: Any
    beams: Any
    shadow: Any


@inlined
def make_path(longest: int) -> Any:
    """Allocate memory for rays of up to `longest` samples."""
    count = longest + 2 * SPAN
    return Path(
        np.empty(count, dtype=np.int32),
        np.empty(count, dtype=np.float32),
        np.empty((count, 3), dtype=np.float32),
        np.zeros((count, 3), dtype=np.float32),
        np.empty(count, dtype=np.float32),
        np.empty((count, 3), dtype=np.float32),
        np.empty(2 * count, dtype=np.int32),
    )


@compiled
def differentiate_windows(
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
    shadows: Any,
    least: Any,
    camera: Any,
    step: float,
    size: int,
    longest: int,
    windows: Any,
    gradients: Any,
    energies: Any,
    nodes: Any,
) -> None:
    """Differentiate half the energy (sum of squared pixel values) of windows of an image.

    Parameters
    ----------
    missing : ndarray of uint8, 1-D, or None
        Voxels that are transparent whatever the TF is: no edit changes them.
    alphas : ndarray of float32, shape (levels,)
        Opacity of a sample at each level.
    colors : ndarray of float32, shape (4 levels,)
        Colour at each level, not premultiplied.
    light : Light or None
        Parameters of gradient shading.
    glow : LightGrid or None
        Soft light.
    shadows : Shadows or None
        Parameters of shadow rays.
    least : float32
        Transparency of a sample below which the derivative is clamped.
    size : int
        Width and height of the image.
    longest : int
        Upper limit of the number of samples along a ray.
    windows : ndarray of int64, shape (n, 4)
        First row, row after the last, first column, column after the last.
    gradients : ndarray of float64, shape (n, 256)
        Output: sum of I dI / d alpha over the pixels and channels of a window,
        alpha being the opacity of one sample at each bin of the TF.
    energies : ndarray of float64, shape (n,)
        Output: sum of I squared.
    nodes : ndarray of float64, 1-D, or None
        In soft light, the sum of I dI over all windows by the light at each of its nodes; added
        to. It is not in `gradients`.
    """
    levels, staging, _ = stack_batch(voxels)
    path = make_path(longest)
    image = np.empty(3, dtype=np.float32)
    gradient = np.empty(TF_SAMPLES + 1)
    for n in range(len(windows)):
        gradient[:] = 0
        energy = 0.0
        for row in range(windows[n, 0], windows[n, 1]):
            for column in range(windows[n, 2], windows[n, 3]):
                ray, _ = make_ray(camera, step, column, row, size)
                if misses(ray, cells, cell_shape, shift):
                    continue
                count = look(
                    voxels, shape, scale, missing, cells, cell_shape, shift,
                    alphas, colors, light, glow, shadows, ray, levels, staging, path, image,
                )  # fmt: skip
                energy += image[0] ** 2 + image[1] ** 2 + image[2] ** 2
                _look_back(missing, alphas, least, ray, path, count, image, gradient)
                if glow is not None:
                    for k in range(count):
                        beam = path.beams[k]
                        weight = beam[0] * image[0] + beam[1] * image[1] + beam[2] * image[2]
                        if weight != ZERO:
                            _divide_light(glow, ray, np.float32(k), weight, nodes)
                if shadows is not None:
                    beams, red, green, blue = path.beams, image[0], image[1], image[2]
                    enough = FAINT_BEAM * strength_of(beams, count)
                    for k in range(count + SPAN):
                        if abs(beams[k, 0]) + abs(beams[k, 1]) + abs(beams[k, 2]) > enough:
                            weight = beams[k, 0] * red + beams[k, 1] * green + beams[k, 2] * blue
                            take_light(
                                voxels, shape, scale, missing, alphas, shadows, ray, k, weight,
                                levels, staging, path.shadow, gradient,
                            )  # fmt: skip
        # One more behind the last bin, for what is above it by nothing.
        gradients[n] = gradient[:TF_SAMPLES]
        energies[n] = energy


@inlined
def _divide_light(glow: Any, ray: Any, k: Any, weight: Any, nodes: Any) -> None:
    """Add a derivative by the light of sample k to the nodes that it is interpolated between."""
    place, fx, fy, fz = light_place(glow, ray, min(k, ray.last))
    for corner in range(8):
        at, share = corner_of(glow, place, fx, fy, fz, corner)
        nodes[at] += share * weight


@inlined
def strength_of(beams: Any, count: int) -> Any:
    """Return the sum of a pixel's derivatives by light."""
    total = ZERO
    for k in range(count + SPAN):
        total += abs(beams[k, 0]) + abs(beams[k, 1]) + abs(beams[k, 2])
    return total


@inlined
def misses(ray: Any, cells: Any, cell_shape: Any, shift: int) -> bool:
    """Return True if a ray meets only empty cells: its pixel is black, its derivative zero."""
    k = 0
    while k < ray.count:
        behind = skip_empty(ray, k, cells, cell_shape, shift)
        if behind == k:
            return False
        k = behind
    return True


@inlined
def look(
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
    shadows: Any,
    ray: Any,
    levels: Any,
    staging: Any,
    path: Any,
    image: Any,
) -> int:
    """Composite front to back, recording what is needed to go back.

    Returns
    -------
    int
        Number of samples recorded. The ray continues until any one of them could be taken
        away without anything behind the last one showing.
    """
    image[:] = ZERO
    through = without_one = ONE
    negligible = NEGLIGIBLE
    if shadows is not None:
        negligible = NEGLIGIBLE_LIT
        for k in range(ray.count + 2 * SPAN):
            path.known[k] = UNKNOWN
            path.beams[k, 0] = path.beams[k, 1] = path.beams[k, 2] = ZERO
    k = 0
    while k < ray.count and without_one > negligible:
        fetch(voxels, shape, scale, missing, ray, k, levels, staging)
        is_empty = True
        for m in range(min(ray.count - k, len(levels))):
            path.levels[k + m] = levels[m]
            is_empty = is_empty and alphas[np.uint64(np.uint32(levels[m]))] <= FAINT
        for _ in range(min(ray.count - k, len(levels))):
            level = np.uint64(np.uint32(path.levels[k]))
            whole = a = alphas[level]
            if k == ray.count - 1:
                a = opacity_of_part(whole, ray.rest)
            path.clear[k] = through
            at = np.uint64(4) * level
            red, green, blue = colors[at], colors[at + np.uint64(1)], colors[at + np.uint64(2)]
            weight = through * a
            # Samples behind an opaque one count, too: its derivative has what is behind it.
            if shadows is not None:
                is_visible = without_one * a > FAINT
                # The last sample shares light with none.
                sharing = ONE if k == ray.count - 1 else a
                arriving = light_at(
                    voxels, shape, scale, missing, cells, cell_shape, shift, alphas, shadows,
                    ray, k, sharing, is_empty, path.known, levels, staging,
                )  # fmt: skip
                if is_visible:
                    d, s, dd, ds, by_light = shade_with_slopes(
                        voxels, shape, light, shadows, ray, np.float32(k), whole, arriving
                    )
                    limit = np.float32(np.inf) if k == ray.count - 1 else ONE
                    pr = ONE if d * red + s < limit else ZERO
                    pg = ONE if d * green + s < limit else ZERO
                    pb = ONE if d * blue + s < limit else ZERO
                    beam = weight * by_light
                    dd += by_light * pass_back(
                        path.known, k, sharing, pr * red * beam, pg * green * beam,
                        pb * blue * beam, path.beams,
                    )  # fmt: skip
                    path.turns[k, 0] = a * pr * (dd * red + ds)
                    path.turns[k, 1] = a * pg * (dd * green + ds)
                    path.turns[k, 2] = a * pb * (dd * blue + ds)
                    red = min(d * red + s, limit)
                    green = min(d * green + s, limit)
                    blue = min(d * blue + s, limit)
                else:
                    arriving *= shadows.diffuse
                    red, green, blue = arriving * red, arriving * green, arriving * blue
                    path.turns[k, 0] = path.turns[k, 1] = path.turns[k, 2] = ZERO
            elif light is not None or glow is not None:
                if glow is not None:
                    path.beams[k, 0] = weight * red
                    path.beams[k, 1] = weight * green
                    path.beams[k, 2] = weight * blue
                d, s = shade(voxels, shape, light, glow, ray, np.float32(k))
                red, green, blue = d * red + s, d * green + s, d * blue + s
            path.colors[k, 0], path.colors[k, 1], path.colors[k, 2] = red, green, blue
            image[0] += weight * red
            image[1] += weight * green
            image[2] += weight * blue
            without_one = max(without_one * (ONE - a), through)
            through -= weight
            k += 1
    return k


@inlined
def _look_back(
    missing: Any,
    alphas: Any,
    least: Any,
    ray: Any,
    path: Any,
    count: int,
    image: Any,
    gradient: Any,
) -> None:
    """Traverse back to front, adding each sample's derivative to its two adjacent bins."""
    composited = ZERO
    red, green, blue = image[0], image[1], image[2]
    for k in range(count - 1, -1, -1):
        if missing is not None and path.levels[k] == NOTHING:
            continue
        level = np.uint64(np.uint32(path.levels[k]))
        a = alphas[level]
        # Only the dot product of colour and pixel is needed: one number instead of three.
        color = red * path.colors[k, 0] + green * path.colors[k, 1] + blue * path.colors[k, 2]
        turn = red * path.turns[k, 0] + green * path.turns[k, 1] + blue * path.turns[k, 2]
        over = color - composited
        slope = over
        if k == ray.count - 1:
            slope *= slope_of_part(a, ray.rest, least)
            a = opacity_of_part(a, ray.rest)
        slope = path.clear[k] * (slope + turn)
        composited += a * over
        lower = level // np.uint64(LEVELS_PER_BIN)
        share = np.float32(np.int32(level % np.uint64(LEVELS_PER_BIN))) / np.float32(LEVELS_PER_BIN)
        gradient[lower] += slope * (ONE - share)
        gradient[lower + np.uint64(1)] += slope * share
