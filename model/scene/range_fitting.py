"""Fitting a transfer function (TF) to the scalar range of another volume."""

from __future__ import annotations

from dataclasses import replace

from model.scene.robust_range import robust_range
from model.scene.transfer_function import (
    TF_SAMPLES,
    ColorTF,
    OpacityTF,
    Range,
    TransferFunction,
)
from model.scene.value_scale import place_of
from model.scene.volume import Volume

LEAST_OVERLAP = 4 / TF_SAMPLES
"""Fraction of a TF's range below which its part in the volume is no use: 4 of the 256 samples."""

LEAST_SHARE, LEAST_STEPS = 1 / 1024, 8
"""Fraction of the volume's range, or steps of its whole numbers, that a TF must cover to be meant
for them: 40 HU in a CT are, [0, 1] is not."""


def fit_to_volume(transfer_function: TransferFunction, volume: Volume) -> TransferFunction:
    """Convert a TF made for any volume to the one that shows it in another volume.

    A TF keeps its values and its range where these fit the volume: so a TF over a part of the
    values, or over those of another CT, shows the same tissue as where it was made. It keeps its
    scale, too: the volume is to be shown on that. It fits if
    its range has at least 1/64 of itself in common with the volume's scalar range, its robust
    range or the range of its voxels, and that is 1/1024 of these, or 8 steps of whole numbers.
    A TF over far more than that, such as all values of 16 bits, is cut to the volume's scalar
    range if it has something to say there. Any other, such as one over [0, 1] in a CT, is
    stretched to that range, as a relative TF is.

    Parameters
    ----------
    transfer_function : TransferFunction
        As it was loaded.
    volume : Volume
        Over the range that it has without this TF.

    Returns
    -------
    TransferFunction
        Its range and scale are those to show the volume over:
        :meth:`model.scene.volume.Volume.over`.

    Raises
    ------
    VolumeError
        When the TF is over logarithms, which the volume's values do not have.
    """
    if transfer_function.is_relative:
        return stretch_to_range(transfer_function.on_scale(volume.scale), volume.scalar_range)
    if transfer_function.scale != volume.scale:
        if _overlaps_logarithms(transfer_function, volume):
            # Known without computing these, which takes time.
            return transfer_function
        volume = volume.on_scale(transfer_function.scale)
        volume = volume.over(robust_range(volume))
    own, step = transfer_function.scalar_range, volume.distribution.step
    if (
        _overlap(own, volume.scalar_range, step)
        or _overlap(own, volume.data_range, step)
        or _overlap(own, robust_range(volume), step)
    ):
        return transfer_function
    if _is_about(transfer_function, volume.scalar_range):
        return fit_to_range(transfer_function, volume.scalar_range)
    return stretch_to_range(transfer_function, volume.scalar_range)


def fit_to_range(transfer_function: TransferFunction, scalar_range: Range) -> TransferFunction:
    """Convert a TF made for any scalar range to one over a given scalar range.

    Values keep their positions in the data's units, so that a TF made for one CT
    shows the same tissue in another. Only if the TF is relative, or the two ranges are
    disjoint, is the TF mapped linearly from its range to the new one. Colour stops, and the
    points of a free curve, are cut or extended to span the range exactly; inside it the TF is
    unchanged. The scale remains the TF's.
    """
    lo, hi = scalar_range
    own_lo, own_hi = transfer_function.scalar_range
    if transfer_function.is_relative or own_hi <= lo or hi <= own_lo:
        transfer_function = stretch_to_range(transfer_function, scalar_range)
    opacity, color = opacity_over(transfer_function.opacity, scalar_range), transfer_function.color
    if (color.stops[0][0], color.stops[-1][0]) != scalar_range:
        inner = tuple(s for s in color.stops if lo < s[0] < hi)
        color = ColorTF(scalar_range, (_stop(color, lo), *inner, _stop(color, hi)))
    return TransferFunction(opacity, color)


def opacity_over(opacity: OpacityTF, scalar_range: Range) -> OpacityTF:
    """Return an opacity TF over another range, with its values as they are.

    The points of a free curve are cut or extended to span the range exactly.
    """
    if opacity.scalar_range == scalar_range:
        # Jumps at its ends, two points at one value, stay.
        return opacity
    (lo, hi), points = scalar_range, opacity.points
    if points:
        inside = tuple(p for p in points if lo < p[0] < hi)
        points = ((lo, float(opacity(lo))), *inside, (hi, float(opacity(hi))))
    return replace(opacity, scalar_range=scalar_range, points=points)


def _overlaps_logarithms(transfer_function: TransferFunction, volume: Volume) -> bool:
    """Whether a TF over logarithms has enough in common with the positive values of a volume."""
    lo, hi = volume.linear.data_range
    if transfer_function.scale != "log" or hi <= 0:
        return False
    own = transfer_function.scalar_range
    return _overlap(own, (place_of(lo, "log") if lo > 0 else own[0], place_of(hi, "log")), None)


def _overlap(own: Range, other: Range, step: int | None) -> bool:
    """Whether a TF's range has enough in common with one of a volume, of whole numbers or not."""
    common = min(own[1], other[1]) - max(own[0], other[0])
    least = LEAST_SHARE * (other[1] - other[0])
    if step is not None:
        least = min(least, LEAST_STEPS * step)
    return common >= max(least, LEAST_OVERLAP * (own[1] - own[0])) and common > 0


def _is_about(transfer_function: TransferFunction, scalar_range: Range) -> bool:
    """Whether a TF over more than a range changes in it: by modes that fit in, or by points."""
    (lo, hi), own = scalar_range, transfer_function.scalar_range
    if not own[0] <= lo < hi <= own[1]:
        return False
    opacity = transfer_function.opacity
    modes = [m for m in opacity.modes if lo < m.mean < hi and m.width < hi - lo]
    # One may lie there by chance.
    return bool(modes) or sum(lo < value < hi for value, _opacity in opacity.points) > 1


def _stop(color: ColorTF, value: float) -> tuple[float, float, float, float]:
    """Return a stop with the present colour at a value."""
    red, green, blue = color(value)
    return value, float(red), float(green), float(blue)


def stretch_to_range(transfer_function: TransferFunction, scalar_range: Range) -> TransferFunction:
    """Map every value of a TF linearly from its own range to another."""
    lo, hi = scalar_range
    own_lo, own_hi = transfer_function.scalar_range

    def moved(value: float) -> float:
        # Rounding must not put the end elsewhere.
        return hi if value == own_hi else lo + (value - own_lo) / (own_hi - own_lo) * (hi - lo)

    scale = (hi - lo) / (own_hi - own_lo)
    opacity, color = transfer_function.opacity, transfer_function.color
    modes = tuple(replace(m, mean=moved(m.mean), width=m.width * scale) for m in opacity.modes)
    points = tuple((moved(v), a) for v, a in opacity.points)
    stops = tuple((moved(v), r, g, b) for v, r, g, b in color.stops)
    moved_opacity = replace(opacity, scalar_range=scalar_range, modes=modes, points=points)
    return TransferFunction(moved_opacity, ColorTF(scalar_range, stops))
