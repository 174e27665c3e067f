"""Interpolation of a batch of samples of a ray, the larger part of the ray caster's time.

A CPU has vectors for the arithmetic but has to load voxels one by one, and a
compiler that is given both in one loop moves every index and every voxel
between the two kinds of registers. So they are three loops: places and
weights of all samples, their voxels, the interpolation. In between, the
numbers lie on the stack.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from llvmlite import ir
from numba import carray, types
from numba.extending import intrinsic

from model.compilation import inlined
from model.rendering.raycast.tables import LEVELS, NOTHING
from model.rendering.raycast.trilinear import (
    blend,
    halves,
    interpolate,
    load_pair,
    locate,
    pair_type,
)

BATCH = 32
"""Samples of a ray that are interpolated together: two vectors of AVX-512, four of AVX2."""

ZERO, HALF = np.float32(0), np.float32(0.5)


class Staging(NamedTuple):
    """What the loops of a batch pass on to each other, an array each.

    Attributes
    ----------
    place : ndarray of uint64
        Index of the voxel before the sample along each axis.
    x, y, z : ndarray of float32
        Share of the way to the next voxel.
    near, above, behind, both : ndarray
        Pairs of voxels along x: in that place, in the next row, in the next
        layer, and in the next row of the next layer.
    """

    place: Any
    x: Any
    y: Any
    z: Any
    near: Any
    above: Any
    behind: Any
    both: Any


@intrinsic  # type: ignore[untyped-decorator]
def _stack(_context: Any, like: Any) -> Any:
    """Memory for :data:`BATCH` numbers of a type, or for pairs of an array's elements.

    Nothing else points to it: with an array of Numba's own the compiler could
    not know that writing to it leaves the volume as it is.
    """
    kind = pair_type(like) if isinstance(like, types.Array) else like.dtype

    def reserve(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        unit = context.get_value_type(kind)
        with builder.goto_entry_block():
            memory = builder.alloca(ir.ArrayType(unit, BATCH))
            memory.align = 64
        return builder.bitcast(memory, unit.as_pointer())

    return types.CPointer(kind)(like), reserve


@intrinsic  # type: ignore[untyped-decorator]
def _one_by_one(_context: Any) -> Any:
    """Keeps the compiler from making vector code of a loop."""

    def mark(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        builder.asm(ir.FunctionType(ir.VoidType(), []), "", "", [], side_effect=True)
        return context.get_dummy_value()

    return types.void(), mark


@inlined
def stack_batch(voxels: Any) -> Any:
    """Scratch memory on a CPU's stack for one ray: `levels`, `staging`, and `total` of `march`."""
    staging = Staging(
        carray(_stack(np.uint64), BATCH),
        carray(_stack(np.float32), BATCH),
        carray(_stack(np.float32), BATCH),
        carray(_stack(np.float32), BATCH),
        carray(_stack(voxels), BATCH),
        carray(_stack(voxels), BATCH),
        carray(_stack(voxels), BATCH),
        carray(_stack(voxels), BATCH),
    )
    return carray(_stack(np.int32), BATCH), staging, carray(_stack(np.float32), 4)


@inlined
def fetch(voxels: Any, shape: Any, scale: Any, ray: Any, k: int, levels: Any, staging: Any) -> None:
    """Interpolate a batch of samples from sample k of a ray on.

    Parameters
    ----------
    voxels : ndarray, 1-D
        x fastest.
    shape : tuple of 3 int
        Voxels along x, y and z.
    scale : tuple of 2 float32
        Lowest scalar value, and levels per unit of value.
    ray : Ray
    k : int
    levels : ndarray of int32
        Output: levels of the look-up tables; :data:`NOTHING` behind the ray's end.
    staging : Staging or None
        None to take one sample after the other, as a GPU's thread does.
    """
    # In float32, as 64-bit integers halve the vectors; exact up to 2^24 samples.
    first, last = np.float32(k), np.float32(ray.count - 1)
    for m in range(len(levels)):
        t = min(first + np.float32(np.int32(m)), last)
        x = ray.start[0] + t * ray.step[0]
        y = ray.start[1] + t * ray.step[1]
        z = ray.start[2] + t * ray.step[2]
        if staging is None:
            value = interpolate(voxels, shape, x, y, z)
            levels[m] = _level(value, scale, first + np.float32(np.int32(m)) > last)
        else:
            staging.place[m], staging.x[m], staging.y[m], staging.z[m] = locate(shape, x, y, z)
    if staging is not None:
        row, layer = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
        for m in range(BATCH):
            _one_by_one()
            place = staging.place[m]
            staging.near[m] = load_pair(voxels, place)
            staging.above[m] = load_pair(voxels, place + row)
            staging.behind[m] = load_pair(voxels, place + layer)
            staging.both[m] = load_pair(voxels, place + layer + row)
        for m in range(BATCH):
            value = blend(
                halves(voxels, staging.near[m]),
                halves(voxels, staging.above[m]),
                halves(voxels, staging.behind[m]),
                halves(voxels, staging.both[m]),
                staging.x[m],
                staging.y[m],
                staging.z[m],
            )
            levels[m] = _level(value, scale, first + np.float32(np.int32(m)) > last)


@inlined
def _level(value: Any, scale: Any, outside: Any) -> Any:
    """The nearest level. Rounding may leave the range of values, and the tables with it."""
    level = min(max((value - scale[0]) * scale[1], ZERO), np.float32(LEVELS - 1))
    return np.int32(NOTHING) if outside else np.int32(level + HALF)
