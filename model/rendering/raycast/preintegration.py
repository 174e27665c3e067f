"""Ray marching with pre-integrated classification, which misses no narrow peaks of the TF."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from model.compilation import inlined
from model.rendering.raycast.marching import VISIBLE, skip_empty
from model.rendering.raycast.tables import LEVELS
from model.rendering.raycast.trilinear import interpolate


@inlined
def march_segments(
    voxels: Any,
    shape: Any,
    scale: Any,
    cells: Any,
    cell_shape: Any,
    shift: int,
    integrals: Any,
    ray: Any,
    opaque: Any,
) -> Any:
    """Composite the segments between the samples of one ray, from face to face of the volume.

    Parameters and results are those of :func:`model.rendering.raycast.marching.march`,
    with `integrals` from :func:`model.rendering.raycast.tables.preintegrated_table`.
    """
    red = green = blue = alpha = 0.0
    through = 1.0
    first = -1
    before = _level_at(voxels, shape, scale, ray, np.float32(-1))
    k = 0
    while k < ray.count:
        # A segment may cross a cell next to those of its ends.
        behind = skip_empty(ray, k, cells, cell_shape, shift, 1)
        if behind > k:
            k = behind
            before = -1.0
            continue
        share = np.float32(1) if k < ray.count - 1 else ray.rest
        here = _level_at(voxels, shape, scale, ray, min(np.float32(k), ray.last))
        if before < 0.0:
            # The segment up to this sample is empty.
            before = here
        a, r, g, b = _classify(integrals, before, here, share)
        alpha += through * a
        red += through * r
        green += through * g
        blue += through * b
        through *= 1.0 - a
        if first < 0 and through <= 1.0 - VISIBLE:
            first = k
        if through < opaque:
            break
        before = here
        k += 1
    return np.float32(red), np.float32(green), np.float32(blue), np.float32(alpha), first


@inlined
def _level_at(voxels: Any, shape: Any, scale: Any, ray: Any, k: Any) -> float:
    """Return the fractional level of the scalar at sample k."""
    value = interpolate(
        voxels,
        shape,
        max(ray.start[0] + k * ray.step[0], np.float32(0)),
        max(ray.start[1] + k * ray.step[1], np.float32(0)),
        max(ray.start[2] + k * ray.step[2], np.float32(0)),
    )
    return min(max(float((value - scale[0]) * scale[1]), 0.0), float(LEVELS - 1))


@inlined
def _classify(integrals: Any, first: float, last: float, share: Any) -> Any:
    """Opacity and premultiplied RGB of a fraction of a step, between two levels."""
    span = last - first
    if abs(span) < 1.0:
        # Average over one level around the value: an integral between equal ones is empty.
        first = min(max((first + last - 1.0) / 2, 0.0), float(LEVELS - 2))
        last, span = first + 1.0, 1.0
    i, j = min(int(first), LEVELS - 2), min(int(last), LEVELS - 2)
    f, g = first - i, last - j
    depth = _difference(integrals, 0, i, f, j, g) / span * share
    if depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    a = -math.expm1(-depth)
    # Colours within a segment are weighted by extinction, without self-occlusion.
    mixed = a * share / (span * depth)
    return (
        a,
        mixed * _difference(integrals, 1, i, f, j, g),
        mixed * _difference(integrals, 2, i, f, j, g),
        mixed * _difference(integrals, 3, i, f, j, g),
    )


@inlined
def _difference(integrals: Any, column: int, i: int, f: float, j: int, g: float) -> float:
    """Integral of a table's column from level i + f to level j + g."""
    low = integrals[i, column] + f * (integrals[i + 1, column] - integrals[i, column])
    high = integrals[j, column] + g * (integrals[j + 1, column] - integrals[j, column])
    return high - low
