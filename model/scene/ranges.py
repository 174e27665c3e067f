"""Scalar ranges, robust or chosen, transfer functions (TFs) over them, values as text."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError, VolumeError
from model.scene.distribution import Distribution
from model.scene.labels import label_range
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, Range, TransferFunction
from model.scene.value_scale import ValueScale, place_of, value_at
from model.scene.volume import Volume

TAIL = 0.001  # share of the voxels at each end that the range ignores
SQUEEZED = 8  # a range is narrowed if the voxels without tails fill less than 1/8 of it
ROOM = 1.0  # margin of a narrowed range beyond the voxels without tails, in their widths


def percentile_range(volume: Volume, low: float, high: float) -> Range:
    """Return the values below which `low` and `high` per cent of all measured voxels lie.

    Raises :class:`VolumeError` when the percentages are out of order, or the values are the same.
    """
    if not 0 <= low < high <= 100:
        raise VolumeError(
            f"{volume.name}: {low:g} and {high:g} are not a range of percentiles; "
            "give two numbers from 0 to 100, the lower one first."
        )
    values, counts = volume.distribution.frequencies
    lo, hi = _quantiles(values, counts, low / 100, high / 100)
    lowest, highest = volume.data_range
    # Only a sample of many voxels is used, which lacks the outermost ones.
    lo, hi = (lowest if low == 0 else lo), (highest if high == 100 else hi)
    if lo == hi:
        raise VolumeError(
            f"{volume.name}: between {low:g} and {high:g} per cent all voxels are {lo:g}; "
            "choose percentiles that lie farther apart."
        )
    return lo, hi


def robust_range(volume: Volume) -> Range:
    """Return the range of the voxels without a few outliers, a long thin tail, or a fill value.

    The bulk is all voxels but a thousandth at either end and the most frequent value, such as air.
    That value is added if the bulk still fills an eighth of the sum. If the bulk fills an eighth of
    the whole range, the whole range is returned. Otherwise an end farther from the bulk than its
    width is moved in to the outermost voxel within the width; on the side of a frequent value that
    was not added, an eighth of the width is added as a margin. For labels: :func:`label_range`.
    """
    if volume.file.is_labels and volume.scale == "linear":
        return label_range(volume)
    lowest, highest = volume.data_range
    values, counts = volume.distribution.frequencies
    frequent = int(counts.argmax())
    common, is_common = float(values[frequent]), counts[frequent] > TAIL * counts.sum()
    lo, hi, fill = lowest, highest, None
    others = np.arange(len(values)) != frequent if is_common else np.ones(len(values), bool)
    if others.any():
        lo, hi = _without_tails(values[others], counts[others])
    if is_common:
        with_common = min(lo, common), max(hi, common)
        if lo < hi and (with_common[1] - with_common[0]) > SQUEEZED * (hi - lo):
            fill = common
        else:
            lo, hi = with_common
    width = hi - lo
    if width == 0 or highest - lowest <= SQUEEZED * width:
        return lowest, highest
    near_lo, near_hi = _outermost(volume.distribution, lo - ROOM * width, hi + ROOM * width)
    if fill is not None and fill < near_lo:
        near_lo -= width / SQUEEZED
    elif fill is not None and fill > near_hi:
        near_hi += width / SQUEEZED
    if volume.distribution.is_whole:
        near_lo, near_hi = float(np.floor(near_lo)), float(np.ceil(near_hi))
    return max(near_lo, lowest), min(near_hi, highest)


def _without_tails(values: NDArray[np.generic], counts: NDArray[np.int64]) -> Range:
    """Range of the values without a thousandth of them, and at least one, at each end."""
    share = max(TAIL, 1.5 / counts.sum())
    if share >= 0.5:
        return float(values[0]), float(values[-1])
    return _quantiles(values, counts, share, 1 - share)


def _quantiles(
    values: NDArray[np.generic], counts: NDArray[np.int64], low: float, high: float
) -> Range:
    """Quantiles of the values, each one of them."""
    upto = np.cumsum(counts)
    places = np.searchsorted(upto, [low * upto[-1], high * upto[-1]])
    lo, hi = (float(values[place]) for place in places)
    return lo, hi


def _outermost(distribution: Distribution, lo: float, hi: float) -> Range:
    """Smallest and largest voxel from `lo` to `hi`."""

    def ends_of(plane: NDArray[Any]) -> Range:
        inside = plane[(plane >= lo) & (plane <= hi)]
        return (float(inside.min()), float(inside.max())) if inside.size else (np.inf, -np.inf)

    lows, highs = zip(*distribution.of_planes(ends_of), strict=True)
    return min(lows), max(highs)


LEAST_OVERLAP = 4 / TF_SAMPLES  # least share of a TF's range that must lie in the volume

LEAST_SHARE, LEAST_STEPS = 1 / 1024, 8
"""Share of the volume's range, or steps of its whole numbers, that a TF made for it must cover: 40
HU in a CT do, [0, 1] does not."""


def fit_to_volume(transfer_function: TransferFunction, volume: Volume) -> TransferFunction:
    """Convert a TF made for any volume to another volume.

    The result's range and scale are those to show the volume over; pass the volume over its own
    range. If the TF's values fit the volume, see :func:`_overlap`, it keeps them with its scale,
    and shows the same tissue. A far wider one, such as over all values of 16 bits, is cut to the
    scalar range if it varies there. Any other, such as one over [0, 1] in a CT, is stretched to
    that range, like a relative TF. Raises :class:`VolumeError` for a TF over logarithms if the
    volume's values have none.
    """
    if transfer_function.is_relative:
        return stretch_to_range(transfer_function.on_scale(volume.scale), volume.scalar_range)
    if transfer_function.scale != volume.scale:
        if _overlaps_logarithms(transfer_function, volume):
            # Known without computing the logarithms, which takes time.
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

    Values are kept in the data's units, so that a TF made for one CT shows the same tissue in
    another. A relative TF, or one over a disjoint range, is mapped linearly to the new range.
    Colour stops and points are cut or extended to span the range; inside it the TF is unchanged.
    The TF's scale stays.
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
    """Return an opacity TF over another range; a free curve is cut or extended to span it."""
    if opacity.scalar_range == scalar_range:
        # Jumps at its ends, two points at the same value, stay.
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
    """Whether a TF over a wider range varies in this one: by modes that fit in, or by points."""
    (lo, hi), own = scalar_range, transfer_function.scalar_range
    if not own[0] <= lo < hi <= own[1]:
        return False
    opacity = transfer_function.opacity
    modes = [m for m in opacity.modes if lo < m.mean < hi and m.width < hi - lo]
    # A single point may be there by chance.
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
        # Rounding must not move the end.
        return hi if value == own_hi else lo + (value - own_lo) / (own_hi - own_lo) * (hi - lo)

    scale = (hi - lo) / (own_hi - own_lo)
    opacity, color = transfer_function.opacity, transfer_function.color
    modes = tuple(replace(m, mean=moved(m.mean), width=m.width * scale) for m in opacity.modes)
    points = tuple((moved(v), a) for v, a in opacity.points)
    stops = tuple((moved(v), r, g, b) for v, r, g, b in color.stops)
    moved_opacity = replace(opacity, scalar_range=scalar_range, modes=modes, points=points)
    return TransferFunction(moved_opacity, ColorTF(scalar_range, stops))


@dataclass(frozen=True)
class RangeChoice:
    """Chosen scalar range of a volume; invalid ones are a :class:`TfscopeError`."""

    low: float  # in the data's own units, or per cent of the voxels, 0 to 100; low < high
    high: float
    are_percentiles: bool = False

    def __post_init__(self) -> None:
        low, high = self.low, self.high
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise TfscopeError(
                f"The scalar range from {low:g} to {high:g} does not increase; "
                "give its lowest and its highest value."
            )
        if self.are_percentiles and not (low >= 0 and high <= 100):
            raise TfscopeError(
                f"{low:g} and {high:g} per cent are not percentiles; give numbers from 0 to 100."
            )

    @classmethod
    def parse(cls, text: str) -> RangeChoice:
        """Parse ``"LO,HI"``, or ``"LO%,HI%"``; raise :class:`TfscopeError` for anything else."""
        parts = [part.strip() for part in text.split(",")]
        are_percentiles = all(part.endswith("%") for part in parts)
        try:
            low, high = (float(p[:-1] if are_percentiles else p) for p in parts)
        except ValueError:
            raise TfscopeError(
                f"'{text}' is not a scalar range; give its lowest and highest value, such as "
                "0,1500, or percentiles of the voxels, such as 1%,99%."
            ) from None
        return cls(low, high, are_percentiles)

    def of(self, volume: Volume) -> Range:
        """Return the range on a volume's scale, or raise :class:`VolumeError` if it has none."""
        if self.are_percentiles:
            return percentile_range(volume, self.low, self.high)
        if volume.scale == "log" and self.low <= 0:
            raise VolumeError(
                f"{volume.name}: the scalar range starts at {self.low:g}, which has no "
                "logarithm; start above zero, or choose the linear scale."
            )
        return place_of(self.low, volume.scale), place_of(self.high, volume.scale)


PLAIN = 1e6, 1e-6  # numbers below the first, of bins above the second, have no power of ten


def value_text(value: float, scalar_range: Range, scale: ValueScale) -> str:
    """Format a value on a scale to within a bin of a TF over its range: "2.33e-08", ".5"."""
    low, high = scalar_range
    bin_width = (high - low) / (TF_SAMPLES - 1)
    if scale == "log":
        value = value_at(value, scale)
        bin_width = value * (value_at(bin_width, scale) - 1)
        low, high = value, value
    place = math.floor(math.log10(2 * bin_width))
    if bin_width > PLAIN[1] and max(abs(low), abs(high)) < PLAIN[0]:
        text = f"{value:.{max(-place, 0)}f}"
    else:
        digits = 1 if value == 0 else math.floor(math.log10(abs(value))) - place + 1
        text = f"{value:.{max(digits, 1)}g}"
    return text.removeprefix("-") if float(text) == 0 else without_zero(text)


def without_zero(number: str) -> str:
    """Leave out a zero before the point, as in ``"0.25"`` and ``"-0.25"``."""
    digits = number.lstrip("+-")
    return number.replace("0.", ".", 1) if digits.startswith("0.") else number


def range_text(values: Range, scalar_range: Range, scale: ValueScale) -> str:
    """Format two values on a scale as a range, such as ``"260 to 1,900"``; equal ones as one."""
    low, high = (_with_thousands(value_text(value, scalar_range, scale)) for value in values)
    return low if low == high else f"{low} to {high}"


def _with_thousands(text: str) -> str:
    whole, point, rest = text.partition(".")
    return f"{int(whole):,}{point}{rest}" if whole.lstrip("-").isdigit() and whole != "-0" else text
