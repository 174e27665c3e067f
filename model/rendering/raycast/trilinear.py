"""Trilinear interpolation in the volume and in coarser grids."""

from __future__ import annotations

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from model.compilation import called, inlined
from model.rendering.scalars import MASKED, MISSING

ZERO, HALF, ONE = np.float32(0), np.float32(0.5), np.float32(1)
BOTH_MASKED = np.uint16(0x0101 * int(MASKED))  # of a pair of marks


def pair_type(array):
    """Return Numba's unsigned integer type with the width of two elements of an array."""
    return types.Integer.from_bitwidth(2 * array.dtype.bitwidth, signed=False)


@intrinsic
def load_pair(_context, array, index):
    """Load two adjacent elements at once, as an unsigned integer."""

    def load(context, builder, signature, arguments):
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        place = builder.gep(data, [arguments[1]])
        both = context.get_value_type(signature.return_type)
        place = builder.bitcast(place, both.as_pointer())
        return builder.load(place, align=array.dtype.bitwidth // 8)

    return pair_type(array)(array, index), load


@intrinsic
def _split(_context, array, both):
    """Split a pair into two elements of the array's type."""

    def take_apart(context, builder, signature, arguments):
        bits = array.dtype.bitwidth
        both, one = arguments[1], ir.IntType(bits)
        number = context.get_value_type(array.dtype)
        values = [builder.trunc(both, one), builder.trunc(builder.lshr(both, both.type(bits)), one)]
        if number != one:
            values = [builder.bitcast(value, number) for value in values]
        return context.make_tuple(builder, signature.return_type, values)

    return types.UniTuple(array.dtype, 2)(array, both), take_apart


@inlined
def halves(array, both):
    """Return the two elements of a pair as float32."""
    first, second = _split(array, both)
    return np.float32(first), np.float32(second)


@inlined
def locate(shape, x, y, z):
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
    return place, (x - np.float32(i), y - np.float32(j), z - np.float32(k))


@inlined
def rows_at(shape, place):
    """Return where pairs along x begin: at a place, in the next row, in the next layer, in both."""
    row, layer = np.uint64(shape[0]), np.uint64(shape[0] * shape[1])
    return place, place + row, place + layer, place + layer + row


@inlined
def nearest_of(shape, place, weights):
    """Return the voxel nearest to what :func:`locate` found."""
    place += np.uint64(weights[0] >= HALF)
    if weights[1] >= HALF:
        place += np.uint64(shape[0])
    if weights[2] >= HALF:
        place += np.uint64(shape[0] * shape[1])
    return place


@inlined
def weights_of(is_nearest, weights):
    """Return interpolation weights, 0 or 1 where the nearest voxel alone counts."""
    x, y, z = weights
    if is_nearest:
        return np.float32(x >= HALF), np.float32(y >= HALF), np.float32(z >= HALF)
    return x, y, z


@inlined
def hidden_share(marks, shape, is_nearest, place, weights):
    """Return which share of a place that :func:`locate` found is hidden, by marks of voxels.

    It is 1 if the nearest voxel is missing, else the interpolated share of masked voxels, so that a
    mask's edge fades from voxel to voxel. Next to a missing voxel, samples have measured values,
    because its own value was replaced by its neighbours' mean.
    """
    near, above, behind, both = rows_at(shape, place)
    one, two = load_pair(marks, near), load_pair(marks, above)
    three, four = load_pair(marks, behind), load_pair(marks, both)
    if one | two | three | four == 0:
        return ZERO
    if marks[nearest_of(shape, place, weights)] & MISSING:
        return ONE
    return blend(
        halves(marks, one & BOTH_MASKED),
        halves(marks, two & BOTH_MASKED),
        halves(marks, three & BOTH_MASKED),
        halves(marks, four & BOTH_MASKED),
        weights_of(is_nearest, weights),
    )


@inlined
def blend(near, above, behind, both, weights):
    """Interpolate between pairs along x: of the nearest row, next row, layer, and both."""
    fx, fy, fz = weights
    v0 = near[0] + fx * (near[1] - near[0])
    v1 = above[0] + fx * (above[1] - above[0])
    w0 = behind[0] + fx * (behind[1] - behind[0])
    w1 = both[0] + fx * (both[1] - both[0])
    v = v0 + fy * (v1 - v0)
    w = w0 + fy * (w1 - w0)
    return v + fz * (w - v)


@inlined
def value_at(voxels, shape, place, weights):
    """Interpolate in a flat grid, x fastest, at what :func:`locate` found."""
    near, above, behind, both = rows_at(shape, place)
    return blend(
        halves(voxels, load_pair(voxels, near)),
        halves(voxels, load_pair(voxels, above)),
        halves(voxels, load_pair(voxels, behind)),
        halves(voxels, load_pair(voxels, both)),
        weights,
    )


@inlined
def clamp(place, count):
    """Return the nearest position along an axis that lies between its voxels."""
    return min(max(place, np.float32(0)), np.float32(count - 1))


@inlined
def smoothed(medium, value, x, y, z):
    """Return a value interpolated linearly, blended with a cubic B-spline's by `medium.smooth`."""
    if medium.smooth <= ZERO:
        return value
    return value + medium.smooth * (_spline_at(medium.voxels, medium.shape, x, y, z) - value)


@called
def _spline_at(voxels, shape, x, y, z):
    """Return a cubic B-spline's value, from the 64 voxels around."""
    i, j, k = np.int32(x), np.int32(y), np.int32(z)
    total = ZERO
    for n in range(16):
        b, c = j - 1 + (n & 3), k - 1 + (n >> 2)
        row = shape[0] * (min(max(b, 0), shape[1] - 1) + shape[1] * min(max(c, 0), shape[2] - 1))
        line = ZERO
        for a in range(i - 1, i + 3):
            voxel = np.float32(voxels[np.uint64(row + min(max(a, 0), shape[0] - 1))])
            line += spline(x - np.float32(a))[0] * voxel
        total += spline(y - np.float32(b))[0] * spline(z - np.float32(c))[0] * line
    return total


@inlined
def spline(u):
    """Cubic B-spline at a distance of up to 2, and its derivative."""
    t = abs(u)
    if t < ONE:
        value = np.float32(2 / 3) - t * t + HALF * t * t * t
        return value, u * (np.float32(1.5) * t - np.float32(2))
    rest = np.float32(2) - t
    slope = -HALF * rest * rest
    return rest * rest * rest / np.float32(6), slope if u > ZERO else -slope
