"""Front-to-back compositing of a group of samples, with all four channels in one vector."""

from __future__ import annotations

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

FAST = ("contract", "reassoc", "nsz", "arcp")
GROUP = 4  # samples that are first composited among themselves, to shorten chains of dependencies


@intrinsic
def composite_group(_context, rows, alphas, levels, first, total, through):
    """Composite :data:`GROUP` samples behind the ones before them; for CPUs only."""
    f32, i32, i64 = ir.FloatType(), ir.IntType(32), ir.IntType(64)
    vector = ir.VectorType(f32, 4)

    def composite(context, builder, signature, arguments):
        def data(number):
            array = context.make_array(signature.args[number])
            return array(context, builder, arguments[number]).data

        def splat(value):
            single = builder.insert_element(ir.Constant(vector, ir.Undefined), value, i32(0))
            return builder.shuffle_vector(
                single, single, ir.Constant(ir.VectorType(i32, 4), [0] * 4)
            )

        def times(a, b):
            return builder.fmul(a, b, flags=FAST)

        def over(front, clear, back):
            return builder.fadd(front, times(clear, back), flags=FAST)

        one = ir.Constant(vector, [1.0] * 4)
        parts = []
        for i in range(GROUP):
            place = builder.add(arguments[3], i64(i))
            level = builder.zext(builder.load(builder.gep(data(2), [place])), i64)
            row = builder.gep(data(0), [builder.mul(level, i64(4))])
            color = builder.load(builder.bitcast(row, vector.as_pointer()), align=4)
            alpha = splat(builder.load(builder.gep(data(1), [level])))
            parts.append((color, builder.fsub(one, alpha, flags=FAST)))
        while len(parts) > 1:
            parts = [
                (over(front, clear, back), times(clear, further))
                for (front, clear), (back, further) in zip(parts[::2], parts[1::2], strict=True)
            ]
        ((color, clear),) = parts
        place = builder.bitcast(data(4), vector.as_pointer())
        light = splat(arguments[5])
        builder.store(over(builder.load(place, align=4), light, color), place, align=4)
        return builder.extract_element(times(light, clear), i32(0))

    return types.float32(rows, alphas, levels, types.int64, total, types.float32), composite
