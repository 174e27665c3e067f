"""Ray marching with pre-integrated classification, which misses no narrow peaks of the TF."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from model.compilation import inlined
from model.rendering.raycast.batch import fetch, hide, level_of
from model.rendering.raycast.marching import VISIBLE
from model.rendering.raycast.rays import skip_empty
from model.rendering.raycast.tables import LEVELS
from model.rendering.raycast.trilinear import interpolate_inside

NOWHERE = -(2**30)
"""Stands for the level at the beginning of a segment that is yet to be found."""

HIDDEN = NOWHERE + 1
"""Stands for the level of a sample that is transparent; so are the segments that it ends."""


@inlined
def march_segments(
    voxels: Any,
    shape: Any,
    scale: Any,
    missing: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    integrals: Any,
    ray: Any,
    opaque: Any,
    levels: Any,
    staging: Any,
    total: Any,
) -> int:
    """Composite the segments between the samples of one ray, from face to face of the volume.

    Parameters and results are those of :func:`model.rendering.raycast.marching.march`,
    with `integrals` from :func:`model.rendering.raycast.tables.preintegrated_table`.
    """
    total[0] = total[1] = total[2] = total[3] = np.float32(0)
    through = 1.0
    first = -1
    before = NOWHERE
    k = 0
    while k < ray.count and through >= opaque:
        # A segment may cross a cell next to those of its ends.
        behind = skip_empty(ray, k, cells, cell_shape, shift, 1)
        if behind > k:
            k = behind
            before = NOWHERE
            continue
        fetch(voxels, shape, scale, None, ray, k, levels, staging)
        if missing is not None:
            hide(missing, shape, ray, k, levels, HIDDEN)
        if before == NOWHERE:
            # The segment up to this sample is empty, unless it is the first one.
            before = _level_at_entry(voxels, shape, scale, ray) if k == 0 else levels[0]
        for m in range(min(len(levels), ray.count - k)):
            if missing is not None and (before == HIDDEN or levels[m] == HIDDEN):
                before = levels[m]
                continue
            share = 1.0 if k + m < ray.count - 1 else float(ray.rest)
            low, high = min(before, levels[m]), max(before, levels[m])
            before = levels[m]
            inside = low >= 0 and high < LEVELS
            if low == high:
                # Over one level around the value: an integral between equal ones is empty.
                low, high = low - 1, high + 1
                if inside:
                    low, high = max(low, 0), min(high, LEVELS - 1)
            i = np.uint64(low if inside else min(max(low, 0), LEVELS - 1))
            j = np.uint64(high if inside else min(max(high, 0), LEVELS - 1))
            depth = integrals[j, 0] - integrals[i, 0]
            if not inside:
                depth += _beyond(integrals, low, high, 0)
            if depth <= 0.0:
                continue
            span = high - low
            a = -math.expm1(-depth * share / span)
            # Colours within a segment are weighted by extinction, without self-occlusion.
            weight = through * a / depth
            total[0] += np.float32(weight * (integrals[j, 1] - integrals[i, 1]))
            total[1] += np.float32(weight * (integrals[j, 2] - integrals[i, 2]))
            total[2] += np.float32(weight * (integrals[j, 3] - integrals[i, 3]))
            if not inside:
                total[0] += np.float32(weight * _beyond(integrals, low, high, 1))
                total[1] += np.float32(weight * _beyond(integrals, low, high, 2))
                total[2] += np.float32(weight * _beyond(integrals, low, high, 3))
            total[3] += np.float32(through * a)
            through *= 1.0 - a
            if first < 0 and through <= 1.0 - VISIBLE:
                first = k + m
        k += len(levels)
    return first


@inlined
def _beyond(integrals: Any, low: int, high: int, column: int) -> Any:
    """Return the part of an integral between two levels that is beyond the tables' ends.

    The outermost values go on there.
    """
    last = LEVELS - 1
    below, above = min(high, 0) - min(low, 0), max(high, last) - max(low, last)
    first = integrals[1, column] - integrals[0, column]
    return below * first + above * (integrals[last, column] - integrals[last - 1, column])


@inlined
def _level_at_entry(voxels: Any, shape: Any, scale: Any, ray: Any) -> Any:
    """Return the level where the ray enters the volume."""
    value = interpolate_inside(
        voxels,
        shape,
        ray.start[0] - ray.step[0],
        ray.start[1] - ray.step[1],
        ray.start[2] - ray.step[2],
    )
    return level_of(value, scale)
