"""Fitting a transfer function (TF) to the scalar range of another volume."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.scene.transfer_function import ColorTF, OpacityTF, Range, TransferFunction


def fit_to_range(transfer_function: TransferFunction, scalar_range: Range) -> TransferFunction:
    """Convert a TF made for any scalar range to one over a volume's scalar range.

    Values keep their positions in the data's units, so that a TF made for one CT
    shows the same tissue in another. Only if the two ranges are disjoint is the TF
    mapped linearly from its range to the new one. Colour stops, and the points of a
    free curve, are cut or extended to span the range exactly; inside it the TF is
    unchanged.
    """
    lo, hi = scalar_range
    own_lo, own_hi = transfer_function.scalar_range
    if own_hi <= lo or hi <= own_lo:
        transfer_function = _stretched(transfer_function, scalar_range)
    opacity, color = transfer_function.opacity, transfer_function.color
    points = opacity.points
    if points:
        inside = tuple(p for p in points if lo < p[0] < hi)
        points = ((lo, float(opacity(lo))), *inside, (hi, float(opacity(hi))))
    inner = tuple(s for s in color.stops if lo < s[0] < hi)
    stops = (_stop(color, lo), *inner, _stop(color, hi))
    return TransferFunction(
        OpacityTF(scalar_range, opacity.modes, points), ColorTF(scalar_range, stops)
    )


def _stop(color: ColorTF, value: float) -> tuple[float, float, float, float]:
    """Return a stop with the present colour at a value."""
    red, green, blue = color(value)
    return value, float(red), float(green), float(blue)


def _stretched(transfer_function: TransferFunction, scalar_range: Range) -> TransferFunction:
    """Map every value linearly from the TF's own range to another."""
    own = transfer_function.scalar_range
    scale = (scalar_range[1] - scalar_range[0]) / (own[1] - own[0])

    def moved(value: float) -> float:
        return float(np.interp(value, own, scalar_range))

    opacity, color = transfer_function.opacity, transfer_function.color
    modes = tuple(replace(m, mean=moved(m.mean), width=m.width * scale) for m in opacity.modes)
    points = tuple((moved(v), a) for v, a in opacity.points)
    stops = tuple((moved(v), r, g, b) for v, r, g, b in color.stops)
    return TransferFunction(OpacityTF(scalar_range, modes, points), ColorTF(scalar_range, stops))
