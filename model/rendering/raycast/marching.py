"""Ray marching on CPU threads: the samples of one ray become a pixel.

Emission and absorption are composited front to back (paper, Eqs. 1 to 3).

A version is compiled for each light: one version for all lights would take a fifth longer. All
other variants are flags and lengths of arrays, as Numba compiles one version for each combination
of argument types.
"""

from __future__ import annotations

import math

import numpy as np

from model.compilation import compiled, inlined
from model.rendering.raycast.batch import BATCH, fetch, stack_batch, stack_pixel
from model.rendering.raycast.classification import NOTHING
from model.rendering.raycast.compositing import GROUP, composite_group
from model.rendering.raycast.rays import ONE, TINY, ZERO, make_ray, next_visible
from model.rendering.raycast.shading import received, reflect

VISIBLE = np.float32(1 / 255)  # accumulated opacity at which something visible is met

FAINT = np.float32(5e-6)
"""Weight below which a sample's shading is skipped: 500 such samples are less than 1/255 in all.

It is smaller in proportion for a dark image, which would otherwise be black."""

FULL = np.float32(0.004)
"""Weight above which a sample has its own shading alone; less in a faint image."""

SHARED = 6
"""Samples in a row that share the shading of their middle where they are fainter.

Between :data:`FADING` of :data:`FULL` and :data:`FULL`, their own shading is blended in, so that
pictures do not jump as a TF is edited. Dense samples that are composited together count as one."""

FADING = np.float32(0.75)

HALF = np.float32(0.5)


@inlined
def march(medium, colors, light, glow, ray, opaque, levels, staging, total, piece):
    """Composite the samples of one ray."""
    # The last sample is left to the end, as only its step has another length.
    alphas = medium.alphas
    total[0] = total[1] = total[2] = total[3] = ZERO
    through = ONE
    diffuse, gloss = ONE, ZERO
    # Shared by the samples from `leader` up to `follower`.
    common, common_gloss, leader, follower = ONE, ZERO, 0, 0
    first = -1
    end = np.int32(NOTHING)
    faint, full = FAINT, FULL
    if light is not None:
        faint, full = FAINT * light.dim, FULL * light.dim
    elif glow is not None:
        faint, full = FAINT * glow.dim, FULL * glow.dim
    is_close = len(levels) > BATCH
    # Close samples of a group have one light.
    group = GROUP if is_close else 1
    k = 0
    while True:
        k = next_visible(medium, ray, k)
        if k >= ray.count:
            break
        if is_close:
            # The samples at which the volume is read must not depend on what was skipped.
            k -= k % GROUP
        # A whole batch, even beyond the cell's end: partial vectors would not be faster.
        fetch(medium, ray, k, levels, staging)
        if ray.count - k <= len(levels):
            end = levels[ray.count - 1 - k]
            levels[ray.count - 1 - k] = np.int32(NOTHING)
        before = through
        if light is None and glow is None:
            # As many as are always there, so that the loop over them is unrolled.
            for m in range(0, len(levels), BATCH):
                for n in range(0, BATCH, GROUP):
                    through = composite_group(colors, alphas, levels, m + n, total, through)
        else:
            for m in range(0, len(levels), group):
                if is_close:
                    piece[0] = piece[1] = piece[2] = piece[3] = ZERO
                    clear = composite_group(colors, alphas, levels, m, piece, ONE)
                    r, g, b, a = piece[0], piece[1], piece[2], piece[3]
                else:
                    level = np.uint64(np.uint32(levels[m]))
                    at = np.uint64(4) * level
                    a = alphas[level]
                    clear = ONE - a
                    r, g, b = colors[at], colors[at + np.uint64(1)], colors[at + np.uint64(2)]
                weight = through * a
                if weight > faint:
                    # Grouped by position alone, so that shading does not depend on what is
                    # visible in front.
                    if weight < full:
                        if not leader <= k + m < follower:
                            leader = k + m - (k + m) % (SHARED * group)
                            follower = leader + SHARED * group
                            middle = _middle(leader, SHARED * group)
                            common, common_gloss = shade(medium, light, glow, ray, middle)
                        diffuse, gloss = common, common_gloss
                    if weight > FADING * full:
                        seen = np.float32(k + m)
                        if is_close:
                            seen += _visible_middle(alphas, levels, m, clear)
                        own, own_gloss = shade(medium, light, glow, ray, seen)
                        part = min((weight / full - FADING) / (ONE - FADING), ONE)
                        diffuse += part * (own - diffuse)
                        gloss += part * (own_gloss - gloss)
                    white = gloss * a
                    total[0] += through * (diffuse * r + white)
                    total[1] += through * (diffuse * g + white)
                    total[2] += through * (diffuse * b + white)
                total[3] += weight
                through *= clear
        if first < 0 and through <= ONE - VISIBLE:
            first = k + _first_visible(alphas, levels, before)
        k += len(levels)
        if through < opaque:
            break
    a = alphas[np.uint64(np.uint32(end))]
    if a > TINY and through >= opaque:
        part = through * opacity_of_part(a, ray.rest)
        total[3] += part
        at = np.uint64(4) * np.uint64(np.uint32(end))
        diffuse, gloss = shade(medium, light, glow, ray, ray.last)
        for channel in range(3):
            color = colors[at + np.uint64(channel)] / a
            total[channel] += part * (diffuse * color + gloss)
        if first < 0 and through - part <= ONE - VISIBLE:
            first = ray.count - 1
    return first


@inlined
def _middle(first, count):
    """Return the middle of `count` samples in a row, in steps."""
    return np.float32(first) + np.float32(count - 1) * HALF


@inlined
def _visible_middle(alphas, levels, first, clear):
    """Return the mean position of a group's visible samples, given the group's transparency.

    With its middle instead, each group would show as a ring where light changes with depth.
    """
    total, through = ZERO, ONE
    for n in range(GROUP - 1):
        through *= ONE - alphas[np.uint64(np.uint32(levels[first + n]))]
        total += through - clear
    return min(max(total / (ONE - clear), ZERO), np.float32(GROUP - 1))


@inlined
def opacity_of_part(a, share):
    """Return the opacity of a fraction of a step, a being that of a whole one."""
    return -math.expm1(share * math.log1p(-a))


@inlined
def slope_of_part(a, share, least):
    """Return the derivative of :func:`opacity_of_part` by a.

    It diverges at a = 1; where the transparency 1 - a is below `least`, it is clamped.
    """
    return share * max(ONE - a, least) ** (share - ONE)


@inlined
def shade(medium, light, glow, ray, k):
    """Return the factor of the colour of sample k, and its gloss, under the scene's light."""
    diffuse, gloss = ONE, ZERO
    t = min(k, ray.last)
    if light is not None:
        diffuse, gloss = reflect(medium, light, ray, t)
    if glow is not None:
        diffuse = received(glow, ray, t)
    return diffuse, gloss


@inlined
def _first_visible(alphas, levels, through):
    """Return the index in a batch of the sample at which opacity reaches :data:`VISIBLE`."""
    for m in range(len(levels)):
        through *= ONE - alphas[np.uint64(np.uint32(levels[m]))]
        if through <= ONE - VISIBLE:
            return m
    return len(levels) - 1


@compiled
def draw_rows(medium, colors, light, glow, opaque, camera, step, rows, image, depth, close):
    """Draw some rows of an image (rows, columns, 4), and of its depth, empty if not asked for."""
    size = image.shape[1]
    levels, staging = stack_batch(medium.voxels, GROUP * BATCH if close else BATCH)
    total, piece = stack_pixel(), stack_pixel()
    for row in range(rows[0], rows[1]):
        for column in range(size):
            ray, distance = make_ray(camera, step, column, row, size)
            first = march(medium, colors, light, glow, ray, opaque, levels, staging, total, piece)
            for channel in range(4):
                image[row, column, channel] = total[channel]
            if len(depth) > 0:
                seen = distance + min(first, ray.last) * step if first >= 0 else np.inf
                depth[row, column] = seen
