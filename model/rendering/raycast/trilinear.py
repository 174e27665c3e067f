"""Trilinear interpolation, of the volume and of coarser grids."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cpu import CPUContext
from numba.extending import intrinsic, overload

from model.rendering.raycast.compilation import inlined


def pair(array: Any, index: Any) -> Any:
    """Two neighbours in memory, in float32."""
    return np.float32(array[index]), np.float32(array[index + np.uint64(1)])


@overload(pair)  # type: ignore[untyped-decorator]
def _pair(array: Any, index: Any) -> Any:
    def load(array: Any, index: Any) -> Any:
        first, second = _load_two(array, index)
        return np.float32(first), np.float32(second)

    return load


@intrinsic  # type: ignore[untyped-decorator]
def _load_two(_typing: Any, array: Any, index: Any) -> Any:
    """Two neighbours by one load on the CPU, which is the larger part of an interpolation."""

    def load(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        place = builder.gep(data, [arguments[1]])
        if isinstance(context, CPUContext):
            bits = array.dtype.bitwidth
            both = builder.bitcast(place, ir.IntType(2 * bits).as_pointer())
            both = builder.load(both, align=bits // 8)
            number = context.get_value_type(array.dtype)
            one = ir.IntType(bits)
            values = [
                builder.trunc(both, one),
                builder.trunc(builder.lshr(both, both.type(bits)), one),
            ]
            if number != one:
                values = [builder.bitcast(value, number) for value in values]
        else:
            next_place = builder.gep(place, [ir.IntType(64)(1)])
            values = [builder.load(place), builder.load(next_place)]
        return context.make_tuple(builder, signature.return_type, values)

    return types.UniTuple(array.dtype, 2)(array, index), load


@inlined
def interpolate(voxels: Any, shape: Any, x: Any, y: Any, z: Any) -> Any:
    """Interpolate at a position inside the grid, in float32.

    Parameters
    ----------
    voxels : ndarray, 1-D
        x fastest.
    shape : tuple of 3 int
        Voxels along x, y and z.
    x, y, z : float32
        0 to length - 1; rounding errors outside are extrapolated.
    """
    nx, ny = np.int64(shape[0]), np.int64(shape[1])
    i = min(np.int32(x), np.int32(shape[0] - 2))
    j = min(np.int32(y), np.int32(shape[1] - 2))
    k = min(np.int32(z), np.int32(shape[2] - 2))
    fx, fy, fz = x - np.float32(i), y - np.float32(j), z - np.float32(k)
    # Unsigned, or Numba would look for negative indices at each access.
    a = np.uint64(np.int64(i) + nx * (np.int64(j) + ny * np.int64(k)))
    b = a + np.uint64(nx)
    c = a + np.uint64(nx * ny)
    d = c + np.uint64(nx)
    v00, v01 = pair(voxels, a)
    v10, v11 = pair(voxels, b)
    w00, w01 = pair(voxels, c)
    w10, w11 = pair(voxels, d)
    v0 = v00 + fx * (v01 - v00)
    v1 = v10 + fx * (v11 - v10)
    w0 = w00 + fx * (w01 - w00)
    w1 = w10 + fx * (w11 - w10)
    v = v0 + fy * (v1 - v0)
    w = w0 + fy * (w1 - w0)
    return v + fz * (w - v)


@inlined
def interpolate_inside(voxels: Any, shape: Any, x: Any, y: Any, z: Any) -> Any:
    """Interpolate at any position; those outside take the value on the nearest face."""
    zero = np.float32(0)
    return interpolate(
        voxels,
        shape,
        min(max(x, zero), np.float32(shape[0] - 1)),
        min(max(y, zero), np.float32(shape[1] - 1)),
        min(max(z, zero), np.float32(shape[2] - 1)),
    )
