"""Ray marching, shared by CPU threads and CUDA.

Emission and absorption are composited front to back (paper, Eqs. 1 to 3).

Arguments that a scene does not need are None: Numba compiles one version for each
combination of argument types, without the unused code.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from model.compilation import inlined
from model.rendering.raycast.batch import fetch
from model.rendering.raycast.compositing import GROUP, composite_group
from model.rendering.raycast.rays import ONE, TINY, ZERO, skip_empty
from model.rendering.raycast.shading import received, reflect
from model.rendering.raycast.shadows import APART, UNKNOWN, light_arriving, sought
from model.rendering.raycast.tables import NOTHING

VISIBLE = np.float32(1 / 255)
"""Accumulated opacity at which a ray counts as having met something visible."""

FAINT = np.float32(5e-6)
"""Weight below which a sample's light is left out: 500 of them are less than 1/255 in all.

In an image that is nowhere bright, as much less: it would be black."""

FULL = np.float32(0.004)
"""Weight above which a sample has its own shading alone; less in a faint image."""

SHARED = 6
"""Samples in a row that share the shading of their middle where they are fainter.

From :data:`FADING` of :data:`FULL` on their own fades in: a picture must not jump as its TF is
edited."""

FADING = np.float32(0.75)

HALF = np.float32(0.5)


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
    shadows: Any,
    ray: Any,
    opaque: Any,
    levels: Any,
    staging: Any,
    total: Any,
    scratch: Any,
    close: Any = None,
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
        Precomputed light of soft shadows.
    shadows : Shadows or None
        Parameters of shadow rays, beside those of gradient shading.
    ray : Ray
    opaque : float32
        Transparency below which the ray is terminated.
    levels : ndarray of int32, shape (n,)
    staging : Staging or None
        Scratch memory for a batch of samples; see :func:`model.rendering.raycast.batch.fetch`.
    total : ndarray of float32, shape (4,)
        Output: RGBA, premultiplied.
    scratch : tuple of ndarray
        Memory for the levels along a shadow ray, int32 (n,), and for the light that arrives at
        the samples of a batch and at the next one, float32 (n + 1,).
    close : bool, optional
        Given where samples are close, see :func:`model.rendering.raycast.batch.fetch`; not in
        shadows.

    Returns
    -------
    int
        The sample at which the opacity reaches :data:`VISIBLE`, or -1.
    """
    # The last sample is left to the end, as only its step has another length.
    total[0] = total[1] = total[2] = total[3] = ZERO
    through = ONE
    diffuse, gloss = ONE, ZERO
    common, common_gloss, leader = ONE, ZERO, -1
    first = -1
    end = np.int32(NOTHING)
    faint, full = FAINT, FULL
    if light is not None:
        faint, full = FAINT * light.dim, FULL * light.dim
    elif glow is not None:
        faint, full = FAINT * glow.dim, FULL * glow.dim
    k = 0
    while k < ray.count:
        behind = skip_empty(ray, k, cells, cell_shape, shift)
        if behind > k:
            k = behind
            continue
        if shadows is not None:
            # What was skipped must not decide which samples share light.
            k -= k % APART
        if close is not None:
            # Nor at which ones the volume is read.
            k -= k % GROUP
        # A whole batch, even beyond the cell's end: partial vectors would not be faster.
        fetch(voxels, shape, scale, missing, ray, k, levels, staging, None, close)
        if ray.count - k <= len(levels):
            end = levels[ray.count - 1 - k]
            levels[ray.count - 1 - k] = np.int32(NOTHING)
        before = through
        if shadows is not None:
            for m in range(len(scratch[1])):
                scratch[1][m] = UNKNOWN
        if colors is not None and light is None and glow is None and staging is not None:
            for m in range(0, len(levels), GROUP):
                through = composite_group(colors, alphas, levels, m, total, through)
        elif close is not None and colors is not None:
            # Close samples of a group have one light.
            piece = scratch[1]
            for m in range(0, len(levels), GROUP):
                piece[0] = piece[1] = piece[2] = piece[3] = ZERO
                clear = composite_group(colors, alphas, levels, m, piece, ONE)
                weight = through * piece[3]
                if weight > faint:
                    if weight < full:
                        if _first_of(k + m, SHARED * GROUP) != leader:
                            leader = _first_of(k + m, SHARED * GROUP)
                            common, common_gloss = shade(
                                voxels, shape, light, glow, ray, _middle(leader, SHARED * GROUP)
                            )
                        diffuse, gloss = common, common_gloss
                    if weight > FADING * full:
                        own, own_gloss = shade(
                            voxels, shape, light, glow, ray, _middle(k + m, GROUP)
                        )
                        part = min((weight / full - FADING) / (ONE - FADING), ONE)
                        diffuse += part * (own - diffuse)
                        gloss += part * (own_gloss - gloss)
                    white = gloss * piece[3]
                    total[0] += through * (diffuse * piece[0] + white)
                    total[1] += through * (diffuse * piece[1] + white)
                    total[2] += through * (diffuse * piece[2] + white)
                total[3] += weight
                through *= clear
        else:
            for m in range(len(levels)):
                level = np.uint64(np.uint32(levels[m]))
                a = alphas[level]
                if colors is None:
                    total[3] += through * a
                else:
                    at = np.uint64(4) * level
                    r, g, b = colors[at], colors[at + np.uint64(1)], colors[at + np.uint64(2)]
                    if shadows is not None:
                        if through * a > faint:
                            wanted, arriving = sought(scratch[1], m, a)
                            while wanted >= 0:
                                scratch[1][wanted] = light_arriving(
                                    voxels, shape, scale, missing, cells, cell_shape, shift,
                                    alphas, shadows, ray, np.float32(k + wanted),
                                    scratch[0], staging,
                                )  # fmt: skip
                                wanted, arriving = sought(scratch[1], m, a)
                            diffuse, gloss = shade_in_shadow(
                                voxels, shape, light, shadows, ray, np.float32(k + m), a, arriving
                            )
                            white = gloss * a
                            r, g, b = r * diffuse + white, g * diffuse + white, b * diffuse + white
                            r, g, b = min(r, a), min(g, a), min(b, a)
                        else:
                            r = g = b = ZERO
                    elif light is not None or glow is not None:
                        weight = through * a
                        if weight > faint:
                            # By their place alone: the shading of others does not depend on
                            # what is visible before them.
                            if weight < full:
                                if _first_of(k + m, SHARED) != leader:
                                    leader = _first_of(k + m, SHARED)
                                    common, common_gloss = shade(
                                        voxels, shape, light, glow, ray, _middle(leader, SHARED)
                                    )
                                diffuse, gloss = common, common_gloss
                            if weight > FADING * full:
                                own, own_gloss = shade(
                                    voxels, shape, light, glow, ray, np.float32(k + m)
                                )
                                part = min((weight / full - FADING) / (ONE - FADING), ONE)
                                diffuse += part * (own - diffuse)
                                gloss += part * (own_gloss - gloss)
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
            if shadows is not None:
                arriving = light_arriving(
                    voxels, shape, scale, missing, cells, cell_shape, shift, alphas,
                    shadows, ray, ray.last, scratch[0], staging,
                )  # fmt: skip
                diffuse, gloss = shade_in_shadow(
                    voxels, shape, light, shadows, ray, ray.last, a, arriving
                )
            elif light is not None or glow is not None:
                diffuse, gloss = shade(voxels, shape, light, glow, ray, ray.last)
            for channel in range(3):
                color = colors[at + np.uint64(channel)] / a
                total[channel] += part * (diffuse * color + gloss)
        if first < 0 and through - part <= ONE - VISIBLE:
            first = ray.count - 1
    return first


@inlined
def _first_of(k: int, count: int) -> int:
    """Return the first of the samples, so many in a row, that sample k is among."""
    return k - k % count


@inlined
def _middle(first: int, count: int) -> Any:
    """Return the place amid so many samples in a row."""
    return np.float32(first) + np.float32(count - 1) * HALF


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
        diffuse, gloss, _ = reflect(voxels, shape, light, ray, t)
    if glow is not None:
        factor = received(glow, ray, t)
        diffuse, gloss = diffuse * factor, gloss * factor
    return diffuse, gloss


@inlined
def shade_in_shadow(
    voxels: Any, shape: Any, light: Any, shadows: Any, ray: Any, k: Any, a: Any, arriving: Any
) -> Any:
    """Return the factor of the colour of sample k, of opacity a, and its gloss, in shadows."""
    diffuse, gloss, slope = reflect(voxels, shape, light, ray, min(k, ray.last))
    scattered = math.exp(-slope * shadows.sharpness * a)
    return diffuse + scattered * (shadows.diffuse * arriving - diffuse), (ONE - scattered) * gloss


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
