"""Change of an image with its opacity TF, and visibility of scalar values; on CPU threads.

The change of a pixel is the tangent of front-to-back compositing. With transparency T_i in
front of sample i, opacity a_i, colour c_i and their changes,

    dI = sum of (T_i da_i + dT_i a_i) c_i,   dT_{i+1} = dT_i (1 - a_i) - T_i da_i.

Under direct light, c_i is the colour under that light, which does not depend on the TF. In soft
light it changes, too: the change of the light at the nodes of its grid is known before.
"""

from __future__ import annotations

import numpy as np

from model.compilation import compiled
from model.rendering.raycast.batch import BATCH, fetch, stack_batch
from model.rendering.raycast.classification import ENTRIES, LEVELS_PER_BIN
from model.rendering.raycast.differentiation import NEGLIGIBLE
from model.rendering.raycast.marching import FAINT, opacity_of_part, slope_of_part
from model.rendering.raycast.rays import ONE, ZERO, make_ray, next_visible
from model.rendering.raycast.shading import received, reflect
from model.scene.transfer_function import TF_SAMPLES

_1, _2 = np.uint64(1), np.uint64(2)


@compiled
def change_rows(medium, changes, colors, light, glow, turn_grid, least, camera, step, rows, image):
    """Compute some rows of an image's change."""
    size = image.shape[1]
    levels, staging = stack_batch(medium.voxels, BATCH)
    seen, weights = np.empty(BATCH, dtype=np.float32), np.empty(BATCH, dtype=np.float32)
    glows = len(glow.grid) > 0
    is_lit = light.shines or glows
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, _ = make_ray(camera, step, column, row, size)
            red = green = blue = white = ZERO
            through, change = ONE, ZERO
            k = 0
            while k < ray.count and (through > NEGLIGIBLE or abs(change) > NEGLIGIBLE):
                behind = next_visible(medium, ray, k)
                if behind > k:
                    k = behind
                    continue
                fetch(medium, ray, k, levels, staging)
                count = min(BATCH, ray.count - k)
                for m in range(count):
                    level = np.uint64(np.uint32(levels[m]))
                    a, da = medium.alphas[level], changes[level]
                    if k + m == ray.count - 1:
                        da *= slope_of_part(a, ray.rest, least)
                        a = opacity_of_part(a, ray.rest)
                    visible, weight = through * a, through * da + change * a
                    change = change * (ONE - a) - through * da
                    through *= ONE - a
                    if is_lit:
                        seen[m], weights[m] = visible, weight
                    else:
                        at = np.uint64(4) * (level % np.uint64(ENTRIES))
                        red += weight * colors[at]
                        green += weight * colors[at + _1]
                        blue += weight * colors[at + _2]
                # A loop for each light: a test at each sample would be much slower.
                if glows:
                    for m in range(count):
                        if weights[m] != ZERO or seen[m] > FAINT:
                            t = min(np.float32(k + m), ray.last)
                            weights[m] *= received(glow, ray, t)
                            weights[m] += seen[m] * received(turn_grid, ray, t)
                elif light.shines:
                    for m in range(count):
                        if weights[m] != ZERO:
                            d, s = reflect(medium, light, ray, min(np.float32(k + m), ray.last))
                            white += weights[m] * s
                            weights[m] *= d
                for m in range(count if is_lit else 0):
                    at = np.uint64(4) * (np.uint64(np.uint32(levels[m])) % np.uint64(ENTRIES))
                    red += weights[m] * colors[at]
                    green += weights[m] * colors[at + _1]
                    blue += weights[m] * colors[at + _2]
                k += BATCH
            image[row, column, 0] = red + white
            image[row, column, 1] = green + white
            image[row, column, 2] = blue + white


@compiled
def add_visibility(medium, camera, step, size, windows, visible):
    """Add the weight T_i a_i of each sample in windows to its two adjacent bins."""
    levels, staging = stack_batch(medium.voxels, BATCH)
    for n in range(len(windows)):
        for row in range(windows[n, 0], windows[n, 1]):
            for column in range(windows[n, 2], windows[n, 3]):
                ray, _ = make_ray(camera, step, column, row, size)
                through = ONE
                k = 0
                while through > NEGLIGIBLE:
                    k = next_visible(medium, ray, k)
                    if k >= ray.count:
                        break
                    fetch(medium, ray, k, levels, staging)
                    for m in range(min(len(levels), ray.count - k)):
                        level = np.uint64(np.uint32(levels[m]))
                        a = medium.alphas[level]
                        if k + m == ray.count - 1:
                            a = opacity_of_part(a, ray.rest)
                        weight = through * a
                        through -= weight
                        lower = level % np.uint64(ENTRIES) // np.uint64(LEVELS_PER_BIN)
                        share = np.float32(np.int32(level % np.uint64(LEVELS_PER_BIN)))
                        share /= np.float32(LEVELS_PER_BIN)
                        visible[lower] += weight * (ONE - share)
                        visible[np.uint64(min(int(lower) + 1, TF_SAMPLES - 1))] += weight * share
                    k += len(levels)
