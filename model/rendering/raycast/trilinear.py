"""Trilinear interpolation in the volume and in coarser grids."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from model.compilation import inlined
from model.rendering.scalars import MASKED, MISSING

HALF = np.float32(0.5)


def pair_type(array: Any) -> Any:
    """Return Numba's unsigned integer type with the width of two elements of an array."""
    return types.Integer.from_bitwidth(2 * array.dtype.bitwidth, signed=False)


@intrinsic  # type: ignore[untyped-decorator]
def load_pair(_context: Any, array: Any, index: Any) -> Any:
    """Load two adjacent elements at once, as an unsigned integer; for CPUs only."""

    def load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        place = builder.gep(data, [arguments[1]])
        both = context.get_value_type(signature.return_type)
        place = builder.bitcast(place, both.as_pointer())
        return builder.load(place, align=array.dtype.bitwidth // 8)

    return pair_type(array)(array, index), load


@intrinsic  # type: ignore[untyped-decorator]
def _split(_context: Any, array: Any, both: Any) -> Any:
    """Split a pair into two elements of the array's type."""

    def take_apart(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        bits = array.dtype.bitwidth
        both, one = arguments[1], ir.IntType(bits)
        number = context.get_value_type(array.dtype)
        values = [builder.trunc(both, one), builder.trunc(builder.lshr(both, both.type(bits)), one)]
        if number != one:
            values = [builder.bitcast(value, number) for value in values]
        return context.make_tuple(builder, signature.return_type, values)

    return types.UniTuple(array.dtype, 2)(array, both), take_apart


@inlined
def halves(array: Any, both: Any) -> Any:
    """Return the two elements of a pair as float32."""
    first, second = _split(array, both)
    return np.float32(first), np.float32(second)


@inlined
def locate(shape: Any, x: Any, y: Any, z: Any) -> Any:
    """Return the index of the voxel before a place along each axis, and the weights of the next.

    The place is 0 to length - 1 along each; outside by rounding errors, it is extrapolated. The
    index is unsigned, as Numba checks signed ones for negative numbers.
    """
    i = min(np.int32(x), np.int32(shape[0] - 2))
    j = min(np.int32(y), np.int32(shape[1] - 2))
    k = min(np.int32(z), np.int32(shape[2] - 2))
    # Numba's default is 64 bits; rows need only 32, and twice as many fit into a vector.
    row = np.uint32(np.uint32(j) + np.uint32(np.uint32(shape[1]) * np.uint32(k)))
    place = np.uint64(np.uint32(i)) + np.uint64(np.uint32(shape[0])) * np.uint64(row)
    return place, x - np.float32(i), y - np.float32(j), z - np.float32(k)


@inlined
def nearest_of(shape: Any, place: Any, fx: Any, fy: Any, fz: Any) -> Any:
    """Return the voxel nearest to what :func:`locate` found."""
    place += np.uint64(fx >= HALF)
    if fy >= HALF:
        place += np.uint64(shape[0])
    if fz >= HALF:
        place += np.uint64(shape[0] * shape[1])
    return place


@inlined
def weight_of(is_nearest: Any, f: Any) -> Any:
    """Return an interpolation weight, 0 or 1 where the nearest voxel alone counts."""
    return np.float32(f >= HALF) if is_nearest else f


@inlined
def is_hidden(hidden: Any, shape: Any, is_nearest: Any, place: Any, weights: Any) -> bool:
    """Return whether a place that :func:`locate` found is hidden, by marks of voxels.

    It is where the nearest voxel is missing, and where the share of masked voxels, interpolated, is
    above a half: a mask's edge lies between voxels, and cuts their corners. So what is missing
    takes away what is nearer to it than to any other voxel, and as its value was replaced by that
    of those around it, samples next to it are what was measured there.
    """
    fx, fy, fz = weights
    if hidden[nearest_of(shape, place, fx, fy, fz)] & MISSING:
        return True
    row, layer = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
    share = blend(
        _masked(hidden, place),
        _masked(hidden, place + row),
        _masked(hidden, place + layer),
        _masked(hidden, place + layer + row),
        weight_of(is_nearest, fx),
        weight_of(is_nearest, fy),
        weight_of(is_nearest, fz),
    )
    return bool(share > HALF)


@inlined
def _masked(hidden: Any, place: Any) -> Any:
    return np.float32(hidden[place] & MASKED), np.float32(hidden[place + np.uint64(1)] & MASKED)


@inlined
def blend(near: Any, above: Any, behind: Any, both: Any, fx: Any, fy: Any, fz: Any) -> Any:
    """Interpolate between pairs along x: of the nearest row, next row, layer, and both."""
    v0 = near[0] + fx * (near[1] - near[0])
    v1 = above[0] + fx * (above[1] - above[0])
    w0 = behind[0] + fx * (behind[1] - behind[0])
    w1 = both[0] + fx * (both[1] - both[0])
    v = v0 + fy * (v1 - v0)
    w = w0 + fy * (w1 - w0)
    return v + fz * (w - v)


@inlined
def interpolate(voxels: Any, shape: Any, x: Any, y: Any, z: Any) -> Any:
    """Interpolate at a position inside a flat grid, x fastest; see :func:`locate`."""
    place, fx, fy, fz = locate(shape, x, y, z)
    row, layer = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
    return blend(
        _neighbors(voxels, place),
        _neighbors(voxels, place + row),
        _neighbors(voxels, place + layer),
        _neighbors(voxels, place + layer + row),
        fx,
        fy,
        fz,
    )


@inlined
def _neighbors(voxels: Any, place: Any) -> Any:
    return np.float32(voxels[place]), np.float32(voxels[place + np.uint64(1)])


@inlined
def interpolate_inside(voxels: Any, shape: Any, x: Any, y: Any, z: Any) -> Any:
    """Interpolate at any position, with positions outside clamped to the nearest face."""
    return interpolate(voxels, shape, clamp(x, shape[0]), clamp(y, shape[1]), clamp(z, shape[2]))


@inlined
def clamp(place: Any, count: int) -> Any:
    """Return the nearest position along an axis that lies between its voxels."""
    return min(max(place, np.float32(0)), np.float32(count - 1))
