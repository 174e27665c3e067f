"""Derivatives of shadows by the opacity of samples: of shadow rays, and of light that is shared.

Light that arrives at t is a product A of 1 - a_j along a ray, so that d A / d a_j is minus the
product without the j-th. See :mod:`.shadows`, too.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from model.compilation import inlined
from model.rendering.raycast.batch import fetch
from model.rendering.raycast.rays import ONE, ZERO, skip_empty
from model.rendering.raycast.shading import reflect
from model.rendering.raycast.shadows import (
    APART,
    DARK,
    FAINT,
    fading,
    light_arriving,
    shadow_ray,
    sought,
)
from model.rendering.raycast.tables import LEVELS_PER_BIN, NOTHING

SPAN = 16
"""Samples of a view ray between those whose light is looked for first where nothing is visible."""

CLOSE = np.float32(0.01)
"""Difference of light between two such samples up to which it is interpolated between them."""

OPAQUE = np.float32(1e-6)
"""Transparency below which a sample counts as opaque: it is not divided by."""


@inlined
def light_at(
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
    k: int,
    a: Any,
    is_empty: bool,
    known: Any,
    levels: Any,
    staging: Any,
) -> Any:
    """Return the light of a sample of a view ray, as the image has it.

    Where nothing is visible, light only tells how bright a sample would be. It is then interpolated
    over spans of :data:`SPAN` samples, or parts of them between which light differs.

    Parameters
    ----------
    is_empty : bool
        Whether no sample of the span is visible.
    known : ndarray of float32
        Light that arrives at the samples of the view ray, or :data:`.shadows.UNKNOWN`; added to.
    """
    low, high = k, k
    if is_empty:
        low = k - k % SPAN
        high = low + SPAN
        # At the volume's faces all light arrives, however dark it is behind them.
        if low == 0 or high >= ray.count - 1:
            low = high = k
    while high - low > APART:
        for end in (low, high):
            if known[end] < ZERO:
                known[end] = light_arriving(
                    voxels, shape, scale, missing, cells, cell_shape, shift, alphas, shadows,
                    ray, np.float32(end), levels, staging,
                )  # fmt: skip
        if abs(known[high] - known[low]) <= CLOSE:
            share = np.float32(k - low) / np.float32(high - low)
            return known[low] + share * (known[high] - known[low])
        middle = (low + high) // 2
        if k < middle:
            high = middle
        else:
            low = middle
    wanted, arriving = sought(known, k, a)
    while wanted >= 0:
        known[wanted] = light_arriving(
            voxels, shape, scale, missing, cells, cell_shape, shift, alphas, shadows,
            ray, np.float32(wanted), levels, staging,
        )  # fmt: skip
        wanted, arriving = sought(known, k, a)
    return arriving


@inlined
def shade_with_slopes(
    voxels: Any, shape: Any, light: Any, shadows: Any, ray: Any, k: Any, a: Any, arriving: Any
) -> Any:
    """Return :func:`.marching.shade_in_shadow` of a sample, and its derivatives.

    Returns
    -------
    diffuse, gloss : float32
    diffuse_by_a, gloss_by_a : float32
        By the sample's opacity, which decides how much of its light is scattered.
    diffuse_by_light : float32
    """
    diffuse, gloss, slope = reflect(voxels, shape, light, ray, min(k, ray.last))
    sharpness = slope * shadows.sharpness
    scattered = math.exp(-sharpness * a)
    gain = shadows.diffuse * arriving - diffuse
    turn = -sharpness * scattered
    return (
        diffuse + scattered * gain,
        (ONE - scattered) * gloss,
        turn * gain,
        -turn * gloss,
        scattered * shadows.diffuse,
    )


@inlined
def pass_back(known: Any, k: int, a: Any, red: Any, green: Any, blue: Any, beams: Any) -> Any:
    """Divide a derivative by the light of sample k among the samples that its light comes from.

    Parameters
    ----------
    known : ndarray of float32
        See :func:`light_at`.
    red, green, blue : float32
        Derivative of the pixel by the sample's light.
    beams : ndarray of float32, shape (n, 3)
        Derivative of the pixel by the light that arrives at each sample; added to.

    Returns
    -------
    float32
        Derivative of the sample's light by its own opacity, which decides how it is shared.
    """
    # Two halvings: APART is 4.
    low = k - k % APART
    if k == low or a >= FAINT + FAINT:
        _add(beams, k, ONE, red, green, blue)
        return ZERO
    high = low + APART
    share = np.float32(k - low) / np.float32(APART)
    change = known[high] - known[low]
    counts, by_change, by_opacity = fading(change, a)
    _add(beams, low, (ONE - counts) * (ONE - share), red, green, blue)
    _add(beams, high, (ONE - counts) * share, red, green, blue)
    if counts == ZERO:
        return ZERO
    middle = low + APART // 2
    if k == middle:
        _add(beams, k, counts, red, green, blue)
        inner, own = known[k], ZERO
    else:
        first = low if k < middle else middle
        last = first + APART // 2
        turn = known[last] - known[first]
        second, by_turn, by_own = fading(turn, a)
        half = (known[first] + known[last]) * np.float32(0.5)
        outer = counts * (ONE - second) * np.float32(0.5)
        _add(beams, first, outer, red, green, blue)
        _add(beams, last, outer, red, green, blue)
        inner, own = half, ZERO
        if second > ZERO:
            _add(beams, k, counts * second, red, green, blue)
            gain = known[k] - half
            inner += second * gain
            _add(beams, last, counts * by_turn * gain, red, green, blue)
            _add(beams, first, -counts * by_turn * gain, red, green, blue)
            own = counts * by_own * gain
    gain = inner - known[low] - share * change
    _add(beams, high, by_change * gain, red, green, blue)
    _add(beams, low, -by_change * gain, red, green, blue)
    return own + by_opacity * gain


@inlined
def _add(beams: Any, k: int, share: Any, red: Any, green: Any, blue: Any) -> None:
    beams[k, 0] += share * red
    beams[k, 1] += share * green
    beams[k, 2] += share * blue


@inlined
def take_light(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    alphas: Any,
    shadows: Any,
    ray: Any,
    k: int,
    weight: Any,
    levels: Any,
    staging: Any,
    path: Any,
    taken: Any,
) -> Any:
    """Add the derivative of the light that arrives at sample k, by opacity, to that of all bins.

    Parameters
    ----------
    weight : float
        What the derivative is multiplied by.
    path : ndarray of int32
        Scratch memory for the levels along the shadow ray.
    taken : ndarray, shape (257,)
        Added to; one more behind the last bin.

    Returns
    -------
    first, last : int
        Bins between which something was added.
    """
    towards = shadow_ray(shape, shadows, ray, np.float32(k))
    rest = least = ONE
    opaque, at, j = 0, 0, 0
    while j < towards.count and opaque < 2:
        fetch(voxels, shape, scale, missing, towards, j, levels, staging, True)
        for m in range(min(len(levels), towards.count - j)):
            path[j + m] = levels[m]
            clear = ONE - alphas[np.uint64(np.uint32(levels[m]))]
            if clear < OPAQUE:
                opaque += 1
                at = j + m
            else:
                rest *= clear
                least = min(least, clear)
        j += min(len(levels), towards.count - j)
        # Until any one of them could be taken away without light coming through.
        if (rest if opaque > 0 else rest / least) < DARK:
            break
    first: Any = len(taken)
    last: Any = 0
    if opaque > 1:
        return first, last
    for i in range(at if opaque else 0, at + 1 if opaque else j):
        if missing is not None and path[i] == NOTHING:
            continue
        level = np.uint64(np.uint32(path[i]))
        change = weight * rest
        if opaque == 0:
            change /= ONE - alphas[level]
        lower = level // np.uint64(LEVELS_PER_BIN)
        share = np.float32(np.int32(level % np.uint64(LEVELS_PER_BIN))) / np.float32(LEVELS_PER_BIN)
        taken[lower] -= change * (ONE - share)
        taken[lower + np.uint64(1)] -= change * share
        first, last = min(first, np.int64(lower)), max(last, np.int64(lower))
    return first, last + 1


@inlined
def light_and_change(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    alphas: Any,
    changes: Any,
    shadows: Any,
    ray: Any,
    k: Any,
    levels: Any,
    staging: Any,
) -> Any:
    """Return the light that arrives at sample k of a view ray, and its change.

    Parameters
    ----------
    cells : ndarray of int8, 1-D
        Distance of each cell to the nearest one that is visible or changes.
    changes : ndarray of float32, shape (levels,)
        Of the opacity of a sample at each level.
    """
    towards = shadow_ray(shape, shadows, ray, k)
    through, change = ONE, ZERO
    j = 0
    while j < towards.count and (through > DARK or abs(change) > DARK):
        behind = skip_empty(towards, j, cells, cell_shape, shift)
        if behind > j:
            j = behind
            continue
        fetch(voxels, shape, scale, missing, towards, j, levels, staging, True)
        for m in range(len(levels)):
            level = np.uint64(np.uint32(levels[m]))
            clear = ONE - alphas[level]
            change = change * clear - through * changes[level]
            through *= clear
        j += len(levels)
    return through, change


@inlined
def shared_change(known: Any, changes: Any, m: int, a: Any, da: Any) -> Any:
    """Return the change of the light of sample m of a batch, found by :func:`.shadows.sought`.

    Parameters
    ----------
    known, changes : ndarray of float32
        Light that arrives at the samples of a batch and at the next, and its change.
    a, da : float32
        Opacity of the sample, and its change.
    """
    change, rest, turn = ZERO, ONE, ZERO
    low = m - m % APART
    high = low + APART
    if m == low or a >= FAINT + FAINT:
        return changes[m]
    while True:
        share = np.float32(m - low) / np.float32(high - low)
        across = known[high] - known[low]
        between = known[low] + share * across
        d_across = changes[high] - changes[low]
        counts, by_change, by_opacity = fading(across, a)
        d_counts = by_change * d_across + by_opacity * da
        change += rest * (ONE - counts) * (changes[low] + share * d_across)
        change += (turn * (ONE - counts) - rest * d_counts) * between
        turn = turn * counts + rest * d_counts
        rest *= counts
        if rest == ZERO:
            return change
        middle = (low + high) // 2
        if m == middle:
            return change + rest * changes[middle] + turn * known[middle]
        if m < middle:
            high = middle
        else:
            low = middle
