"""Derivatives of image regions' energy by the opacity of samples at each bin of the TF.

A pixel is composited from samples front to back, with transparency T_i in
front of sample i and colour B_{i+1} composited behind it:

    d I / d alpha_i = T_i (c_i - B_{i+1}).

B is computed back to front. There is no division by 1 - alpha_i, so that the
derivative also holds at opaque samples. Transparent samples are included, since an
edit may make them visible. Under direct light c_i is the colour under that light, which
does not depend on the TF.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from model.compilation import compiled, inlined
from model.rendering.raycast.batch import fetch, stack_batch
from model.rendering.raycast.marching import (
    ONE,
    ZERO,
    make_ray,
    opacity_of_part,
    shade,
    skip_empty,
    slope_of_part,
)
from model.rendering.raycast.tables import LEVELS_PER_BIN, NOTHING
from model.scene.transfer_function import TF_SAMPLES

NEGLIGIBLE = np.float32(1e-6)
"""Transparency below which further samples are neglected."""


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
    least: Any,
    camera: Any,
    step: float,
    size: int,
    longest: int,
    windows: Any,
    gradients: Any,
    energies: Any,
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
    """
    levels, staging, _ = stack_batch(voxels)
    path = np.empty(longest, dtype=np.int32)
    clear = np.empty(longest, dtype=np.float32)
    diffuse, gloss = np.ones(longest, dtype=np.float32), np.zeros(longest, dtype=np.float32)
    image = np.empty(3, dtype=np.float32)
    for n in range(len(windows)):
        gradient = gradients[n]
        gradient[:] = 0
        energy = 0.0
        for row in range(windows[n, 0], windows[n, 1]):
            for column in range(windows[n, 2], windows[n, 3]):
                ray, _ = make_ray(camera, step, column, row, size)
                if misses(ray, cells, cell_shape, shift):
                    continue
                count = look(
                    voxels, shape, scale, missing, alphas, colors, light, ray, levels, staging,
                    path, clear, diffuse, gloss, image,
                )  # fmt: skip
                energy += image[0] ** 2 + image[1] ** 2 + image[2] ** 2
                _look_back(
                    missing,
                    alphas,
                    colors,
                    least,
                    ray,
                    path,
                    clear,
                    diffuse,
                    gloss,
                    count,
                    image,
                    gradient,
                )
        energies[n] = energy


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
    alphas: Any,
    colors: Any,
    light: Any,
    ray: Any,
    levels: Any,
    staging: Any,
    path: Any,
    clear: Any,
    diffuse: Any,
    gloss: Any,
    image: Any,
) -> int:
    """Composite front to back, recording each sample's level, light and transparency before it.

    Returns
    -------
    int
        Number of samples recorded. The ray continues until any one of them could be taken
        away without anything behind the last one showing.
    """
    image[:] = ZERO
    through = without_one = ONE
    k = 0
    while k < ray.count and without_one > NEGLIGIBLE:
        fetch(voxels, shape, scale, missing, ray, k, levels, staging)
        for m in range(min(ray.count - k, len(levels))):
            level = np.uint64(np.uint32(levels[m]))
            a = alphas[level]
            if k == ray.count - 1:
                a = opacity_of_part(a, ray.rest)
            path[k] = levels[m]
            clear[k] = through
            without_one = max(without_one * (ONE - a), through)
            # Samples behind an opaque one count, too: its derivative has what is behind it.
            d, s = ONE, ZERO
            if light is not None:
                d, s = shade(voxels, shape, light, None, ray, np.float32(k))
                diffuse[k], gloss[k] = d, s
            weight = through * a
            image[0] += weight * (d * colors[np.uint64(4) * level] + s)
            image[1] += weight * (d * colors[np.uint64(4) * level + np.uint64(1)] + s)
            image[2] += weight * (d * colors[np.uint64(4) * level + np.uint64(2)] + s)
            through -= weight
            k += 1
    return k


@inlined
def _look_back(
    missing: Any,
    alphas: Any,
    colors: Any,
    least: Any,
    ray: Any,
    path: Any,
    clear: Any,
    diffuse: Any,
    gloss: Any,
    count: int,
    image: Any,
    gradient: Any,
) -> None:
    """Traverse back to front, adding each sample's derivative to its two adjacent bins."""
    composited = ZERO
    red, green, blue = image[0], image[1], image[2]
    for k in range(count - 1, -1, -1):
        if missing is not None and path[k] == NOTHING:
            continue
        level = np.uint64(np.uint32(path[k]))
        a = alphas[level]
        c = np.uint64(4) * level
        # Only the dot product of colour and pixel is needed: one number instead of three.
        color = red * colors[c] + green * colors[c + np.uint64(1)] + blue * colors[c + np.uint64(2)]
        color = diffuse[k] * color + gloss[k] * (red + green + blue)
        slope = clear[k] * (color - composited)
        if k == ray.count - 1:
            slope *= slope_of_part(a, ray.rest, least)
            a = opacity_of_part(a, ray.rest)
        composited += a * (color - composited)
        lower = np.uint64(path[k] // LEVELS_PER_BIN)
        share = np.float32(path[k] % LEVELS_PER_BIN) / np.float32(LEVELS_PER_BIN)
        gradient[lower] += slope * (ONE - share)
        gradient[np.uint64(min(int(lower) + 1, TF_SAMPLES - 1))] += slope * share
