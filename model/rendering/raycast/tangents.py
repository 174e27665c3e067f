"""Change of an image with its opacity TF, and visibility of scalar values; on CPU threads.

The change of a pixel is the tangent of front-to-back compositing. With transparency T_i in
front of sample i, opacity a_i, colour c_i and their changes,

    dI = sum of (T_i da_i + dT_i a_i) c_i,   dT_{i+1} = dT_i (1 - a_i) - T_i da_i.

Under direct light, c_i is the colour under that light, which does not depend on the TF. In shadows
it changes, too: by the sample's own opacity, and as other samples take more or less of its light.
In soft light, the change of the light at the nodes of its grid is known before.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from model.compilation import compiled, inlined
from model.rendering.raycast.batch import BATCH, fetch, stack_batch
from model.rendering.raycast.differentiation import NEGLIGIBLE
from model.rendering.raycast.marching import FAINT, opacity_of_part, shade, slope_of_part
from model.rendering.raycast.rays import ONE, ZERO, make_ray, skip_empty
from model.rendering.raycast.shading import received
from model.rendering.raycast.shadow_derivatives import (
    light_and_change,
    shade_with_slopes,
    shared_change,
)
from model.rendering.raycast.shadows import APART, UNKNOWN, sought
from model.rendering.raycast.tables import LEVELS_PER_BIN
from model.scene.transfer_function import TF_SAMPLES

LEAST = np.float32(1e-7)
"""Change of a pixel below which that of a sample's light is left out."""

_1, _2 = np.uint64(1), np.uint64(2)


@compiled
def change_rows(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    alphas: Any,
    changes: Any,
    colors: Any,
    light: Any,
    glow: Any,
    turn_grid: Any,
    shadows: Any,
    least: Any,
    camera: Any,
    step: float,
    rows: Any,
    image: Any,
) -> None:
    """Compute some rows of an image's change.

    Parameters
    ----------
    cells : ndarray of int8, 1-D
        Distance of each cell to the nearest one that is visible or changes.
    alphas, changes : ndarray of float32, shape (levels,)
        Opacity of a sample at each level, and its change.
    colors : ndarray of float32, shape (4 levels,)
        Colour at each level, not premultiplied.
    light : Light or None
    glow, turn_grid : LightGrid or None
        Soft light, and its change.
    shadows : Shadows or None
    least : float32
        Transparency of a sample below which the derivative is clamped.
    rows : tuple of int
        First row, and the row after the last.
    image : ndarray of float32, shape (size, size, 3)
        Output.
    """
    size = image.shape[1]
    levels, staging, _ = stack_batch(voxels)
    shown = np.empty(BATCH, dtype=np.int32)
    known, turns = np.empty(BATCH + 1, dtype=np.float32), np.empty(BATCH + 1, dtype=np.float32)
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, _ = make_ray(camera, step, column, row, size)
            red = green = blue = ZERO
            through, change = ONE, ZERO
            k = 0
            while k < ray.count and (through > NEGLIGIBLE or abs(change) > NEGLIGIBLE):
                behind = skip_empty(ray, k, cells, cell_shape, shift)
                if behind > k:
                    k = behind
                    continue
                if shadows is not None:
                    # As in the image: what was skipped must not decide which samples share light.
                    k -= k % APART
                    known[:] = UNKNOWN
                fetch(voxels, shape, scale, missing, ray, k, levels, staging)
                # Shadow rays need the memory.
                shown[:] = levels
                for m in range(min(BATCH, ray.count - k)):
                    level = np.uint64(np.uint32(shown[m]))
                    a, da = alphas[level], changes[level]
                    whole, turn, sharing = a, da, a
                    limit = ONE
                    if k + m == ray.count - 1:
                        da *= slope_of_part(a, ray.rest, least)
                        a = opacity_of_part(a, ray.rest)
                        # The last sample shares light with none.
                        sharing, limit = ONE, np.float32(np.inf)
                    seen = through * a
                    weight = through * da + change * a
                    change = change * (ONE - a) - through * da
                    through *= ONE - a
                    at = np.uint64(4) * level
                    if shadows is not None:
                        if abs(weight) > LEAST or seen > FAINT:
                            wanted, arriving = sought(known, m, sharing)
                            while wanted >= 0:
                                known[wanted], turns[wanted] = light_and_change(
                                    voxels, shape, scale, missing, cells, cell_shape, shift,
                                    alphas, changes, shadows, ray, np.float32(k + wanted),
                                    levels, staging,
                                )  # fmt: skip
                                wanted, arriving = sought(known, m, sharing)
                            d, s, d_turn, s_turn, by_light = shade_with_slopes(
                                voxels, shape, light, shadows, ray, np.float32(k + m), whole,
                                arriving,
                            )  # fmt: skip
                            d_turn *= turn
                            s_turn *= seen * turn
                            d_turn += by_light * shared_change(known, turns, m, sharing, turn)
                            d_turn *= seen
                            r, g, b = colors[at], colors[at + _1], colors[at + _2]
                            red += _lit(r, d, s, limit, weight, d_turn, s_turn)
                            green += _lit(g, d, s, limit, weight, d_turn, s_turn)
                            blue += _lit(b, d, s, limit, weight, d_turn, s_turn)
                    elif glow is not None:
                        if weight != ZERO or seen > FAINT:
                            t = min(np.float32(k + m), ray.last)
                            d = weight * received(glow, ray, t) + seen * received(turn_grid, ray, t)
                            red += d * colors[at]
                            green += d * colors[at + _1]
                            blue += d * colors[at + _2]
                    elif weight != ZERO:
                        d, s = ONE, ZERO
                        if light is not None:
                            d, s = shade(voxels, shape, light, None, ray, np.float32(k + m))
                        red += weight * (d * colors[at] + s)
                        green += weight * (d * colors[at + _1] + s)
                        blue += weight * (d * colors[at + _2] + s)
                k += BATCH
            image[row, column, 0] = red
            image[row, column, 1] = green
            image[row, column, 2] = blue


@inlined
def _lit(c: Any, d: Any, s: Any, limit: Any, weight: Any, d_turn: Any, s_turn: Any) -> Any:
    """Change of a channel by a sample of colour c, shaded by d and s, up to a limit."""
    color = d * c + s
    return weight * color + d_turn * c + s_turn if color < limit else weight * limit


@compiled
def add_visibility(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    alphas: Any,
    camera: Any,
    step: float,
    size: int,
    windows: Any,
    visible: Any,
) -> None:
    """Add the weight T_i a_i of each sample in windows to its two adjacent bins.

    Parameters
    ----------
    windows : ndarray of int64, shape (n, 4)
        First row, row after the last, first column, column after the last.
    visible : ndarray of float64, shape (256,)
        Added to.
    """
    levels, staging, _ = stack_batch(voxels)
    for n in range(len(windows)):
        for row in range(windows[n, 0], windows[n, 1]):
            for column in range(windows[n, 2], windows[n, 3]):
                ray, _ = make_ray(camera, step, column, row, size)
                through = ONE
                k = 0
                while k < ray.count and through > NEGLIGIBLE:
                    behind = skip_empty(ray, k, cells, cell_shape, shift)
                    if behind > k:
                        k = behind
                        continue
                    fetch(voxels, shape, scale, missing, ray, k, levels, staging)
                    for m in range(min(len(levels), ray.count - k)):
                        a = alphas[np.uint64(np.uint32(levels[m]))]
                        if k + m == ray.count - 1:
                            a = opacity_of_part(a, ray.rest)
                        weight = through * a
                        through -= weight
                        lower = np.uint64(levels[m] // LEVELS_PER_BIN)
                        share = np.float32(levels[m] % LEVELS_PER_BIN) / np.float32(LEVELS_PER_BIN)
                        visible[lower] += weight * (ONE - share)
                        visible[np.uint64(min(int(lower) + 1, TF_SAMPLES - 1))] += weight * share
                    k += len(levels)
