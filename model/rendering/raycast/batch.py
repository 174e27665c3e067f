"""Interpolation of a batch of samples along a ray, which takes most of the ray caster's time.

Where samples are dense (:data:`CLOSE`), the volume is read at every fourth one and interpolated
linearly between these: thin layers of a TF need many look-ups of the TF, not of the volume. This
does not apply to labels, which are not interpolated.

A CPU has vector arithmetic but must load voxels one by one; with both in one
loop, the compiler moves every index and every voxel between scalar and vector
registers. There are therefore three loops: indices and weights of all samples,
their voxels, and the interpolation, with intermediate arrays on the stack.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic

from model.compilation import inlined
from model.rendering.raycast.classification import ENTRIES, FADES, LEVELS, NOTHING
from model.rendering.raycast.compositing import GROUP
from model.rendering.raycast.rays import place_on
from model.rendering.raycast.trilinear import (
    blend,
    halves,
    hidden_share,
    load_pair,
    locate,
    pair_type,
    rows_at,
    smoothed,
    weights_of,
)

BATCH = 32  # samples of a ray that are interpolated together: two AVX-512 vectors, or four of AVX2

CLOSE = 0.125
"""Sample distance, in voxels, up to which the volume is read at every fourth sample only."""

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)

HIGHEST = np.float32(LEVELS - 1)

SHORT = np.float32(1e-6)  # least fraction of a step that is used as a divisor


class Staging(NamedTuple):
    """Intermediate arrays passed between the loops of a batch."""

    place: Any  # uint64 array: index of the voxel before the sample along each axis
    x: Any
    y: Any
    z: Any  # float32 array: interpolation weights of the next voxel along each axis
    near: Any
    above: Any
    behind: Any
    both: Any  # arrays of pairs of voxels along x, see `rows_at`


@intrinsic
def _stack(_context, like):
    """Allocate numbers of a type on the stack, or pairs of an array's elements.

    There is room for a batch of close samples, and one more.

    The memory has no aliases; with one of Numba's own arrays, the compiler would
    have to assume that writing to it may change the volume.
    """
    kind = pair_type(like) if isinstance(like, types.Array) else like.dtype
    room = GROUP * BATCH if kind == types.int32 else BATCH

    def reserve(context, builder, _signature, _arguments):
        unit = context.get_value_type(kind)
        with builder.goto_entry_block():
            memory = builder.alloca(ir.ArrayType(unit, room + 1))
            memory.align = 64
        return builder.bitcast(memory, unit.as_pointer())

    return types.CPointer(kind)(like), reserve


@intrinsic
def one_by_one(_context):
    """Prevent the compiler from vectorizing a loop."""

    def mark(context, builder, _signature, _arguments):
        builder.asm(ir.FunctionType(ir.VoidType(), []), "", "", [], side_effect=True)
        return context.get_dummy_value()

    return types.void(), mark


@inlined
def stack_batch(voxels, count):
    """Allocate stack memory for one ray: `levels` of a batch of samples, and `staging`."""
    staging = Staging(
        carray(_stack(np.uint64), BATCH + 1),
        carray(_stack(np.float32), BATCH + 1),
        carray(_stack(np.float32), BATCH + 1),
        carray(_stack(np.float32), BATCH + 1),
        carray(_stack(voxels), BATCH + 1),
        carray(_stack(voxels), BATCH + 1),
        carray(_stack(voxels), BATCH + 1),
        carray(_stack(voxels), BATCH + 1),
    )
    return carray(_stack(np.int32), count), staging


@inlined
def stack_pixel():
    """Allocate stack memory for RGBA."""
    return carray(_stack(np.float32), 4)


@inlined
def fetch(medium, ray, k, levels, staging):
    """Interpolate a batch of samples of a ray, starting with sample k."""
    # In float32, as 64-bit integers would halve the vector width; exact up to 2^24 samples.
    first, last = np.float32(k), np.float32(ray.count - 1)
    voxels, shape, scale = medium.voxels, medium.shape, medium.scale
    if len(levels) == BATCH:
        _read(voxels, shape, medium.is_nearest, ray, k, ONE, BATCH, staging)
        for m in range(BATCH):
            level = level_of(_value(voxels, staging, m), scale)
            levels[m] = np.int32(NOTHING) if first + np.float32(np.int32(m)) > last else level
    else:
        _read(voxels, shape, False, ray, k, np.float32(GROUP), BATCH + 1, staging)
        for m in range(BATCH + 1):
            staging.x[m] = _value(voxels, staging, m)
        # A loop of its own: with a call the one before is not vectorized.
        for m in range(BATCH + 1 if medium.smooth > ZERO else 0):
            x, y, z = place_on(ray, min(first + np.float32(GROUP * m), ray.last))
            staging.x[m] = smoothed(medium, staging.x[m], x, y, z)
        for m in range(BATCH):
            slope = (staging.x[m + 1] - staging.x[m]) / np.float32(GROUP)
            for n in range(GROUP):
                levels[GROUP * m + n] = level_of(staging.x[m] + np.float32(n) * slope, scale)
        if first + np.float32(GROUP * BATCH) > last:
            _end(ray, k, scale, levels, staging)
    if len(medium.missing) > 0:
        _hide(medium, ray, k, levels)


@inlined
def _read(voxels, shape, is_nearest, ray, k, stride, count, staging):
    """Load the voxels around sample k and around each one that is `stride` samples further."""
    first = np.float32(k)
    for m in range(count):
        x, y, z = place_on(ray, min(first + stride * np.float32(np.int32(m)), ray.last))
        staging.place[m], weights = locate(shape, x, y, z)
        staging.x[m], staging.y[m], staging.z[m] = weights_of(is_nearest, weights)
    for m in range(count):
        one_by_one()
        near, above, behind, both = rows_at(shape, staging.place[m])
        staging.near[m] = load_pair(voxels, near)
        staging.above[m] = load_pair(voxels, above)
        staging.behind[m] = load_pair(voxels, behind)
        staging.both[m] = load_pair(voxels, both)


@inlined
def _value(voxels, staging, m):
    return blend(
        halves(voxels, staging.near[m]),
        halves(voxels, staging.above[m]),
        halves(voxels, staging.behind[m]),
        halves(voxels, staging.both[m]),
        (staging.x[m], staging.y[m], staging.z[m]),
    )


@inlined
def _end(ray, k, scale, levels, staging):
    """Set the levels around a ray's end, where what was read is no full stride further."""
    last = np.int32(ray.count - 1)
    for m in range(BATCH):
        whole = ray.last - np.float32(k + GROUP * m)
        slope = staging.x[m + 1] - staging.x[m]
        slope /= min(max(whole, SHORT), np.float32(GROUP))
        for n in range(GROUP):
            at = GROUP * m + n
            if k + at > last:
                levels[at] = np.int32(NOTHING)
            elif whole < np.float32(GROUP):
                levels[at] = level_of(staging.x[m] + min(np.float32(n), whole) * slope, scale)


@inlined
def _hide(medium, ray, k, levels):
    """Fade samples of a batch at places that are hidden in part or entirely."""
    shape = medium.shape
    for m in range(len(levels)):
        x, y, z = place_on(ray, min(np.float32(k) + np.float32(np.int32(m)), ray.last))
        place, weights = locate(shape, x, y, z)
        share = hidden_share(medium.missing, shape, medium.is_nearest, place, weights)
        levels[m] = faded(levels[m], share)


@inlined
def faded(level, share):
    """Return the level's index in the opacity table for a hidden share of 0 to 1."""
    step = np.int32(share * np.float32(FADES) + HALF)
    return np.int32(level + ENTRIES * step) if step < FADES else np.int32(NOTHING)


@inlined
def level_of(value, scale):
    """Round a value to the nearest level, clamped to the lowest and highest one."""
    level = min(max((value - scale[0]) * scale[1], ZERO), HIGHEST)
    return np.int32(level + HALF)
