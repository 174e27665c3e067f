"""Edits of a TF that raise, lower, isolate or cut off scalar values."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from model.scene.tf_editing import as_curve
from model.scene.transfer_function import (
    TF_SAMPLES,
    ColorTF,
    GaussianMode,
    OpacityTF,
    Range,
    TransferFunction,
)

STRIKING_COLORS = (
    (0.90, 0.62, 0.00), (0.34, 0.71, 0.91), (0.00, 0.62, 0.45), (0.94, 0.89, 0.26),
    (0.84, 0.37, 0.00), (0.80, 0.47, 0.65),
)  # fmt: skip
"""Colours for a mode that must stand out, all safe for the colour-blind."""

STEP = 2.0  # factor of the opacity by `raise_value`, and divisor by `lower_value`
DARK = 10  # largest CIELAB lightness (0 to 100) of the background
LEAST_RAISE = 0.05  # opacity of the mode that `raise_value` adds
TINY = 1e-12
MODES_POINTS = 9  # points that replace modes in an isolated range


def add_mode(opacity: OpacityTF, value: float, width: float, height: float) -> OpacityTF:
    """Add a mode of a height and a standard deviation; to a curve of points, add its shape."""
    mode = _mode(value, width, min(max(height, 0.0), 1.0))
    if not opacity.points:
        return replace(opacity, modes=(*opacity.modes, mode))
    added = OpacityTF(opacity.scalar_range, (mode,))
    values = _values_around(opacity, (value, value), width)
    heights = np.minimum(opacity(values) + added(values), 1)
    return replace(opacity, points=_pairs(values, heights))


def add_striking_mode(
    tf: TransferFunction, value: float, width: float, height: float, shown: NDArray[np.floating]
) -> TransferFunction:
    """Add a mode in a colour that stands out in an image region.

    The mode's colour is mixed into the TF's by their opacities, so that values that are already
    opaque keep their colour. For value, width and height see :func:`add_mode`; `shown` (n, 3) are
    the region's colours, in [0, 1].
    """
    around = value + width * np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    stops = np.unique(np.clip(around, *tf.color.scalar_range))
    added = height * np.exp(-(((stops - value) / width) ** 2) / 2)
    shares = added / np.maximum(added + tf.opacity(stops), TINY)
    # From two widths away, colours stay.
    shares[np.abs(stops - value) > 1.99 * width] = 0
    before = np.asarray(tf.color(stops))
    mixed = before + shares[:, None] * (np.array(striking_color(shown)) - before)
    color = _recolored(tf.color, stops, mixed)
    return TransferFunction(add_mode(tf.opacity, value, width, height), color)


def striking_color(shown: NDArray[np.floating]) -> tuple[float, float, float]:
    """Return the colour of :data:`STRIKING_COLORS` farthest from all shown ones, in CIELAB."""
    # Imported here: it takes most of a second.
    from skimage.color import rgb2lab

    choices = rgb2lab(np.array(STRIKING_COLORS))
    if len(shown) == 0:
        return STRIKING_COLORS[0]
    # A few hundred pixels are enough.
    some = shown[:: max(1, len(shown) // 512)]
    lab = rgb2lab(np.clip(some, 0, 1).astype(np.float64))
    distances = np.linalg.norm(choices[:, None] - lab[None], axis=-1)
    # Dark pixels are the background, where every colour stands out.
    visible = lab[:, 0] > DARK
    nearest = distances[:, visible].min(axis=1) if visible.any() else distances.min(axis=1)
    return STRIKING_COLORS[int(nearest.argmax())]


def _recolored(color: ColorTF, values: NDArray[np.float64], colors: NDArray[np.float64]) -> ColorTF:
    """Replace the stops in a closed interval of values by others."""
    kept = [stop for stop in color.stops if not values[0] <= stop[0] <= values[-1]]
    rows = np.column_stack([values, colors]).tolist()
    added = [(value, red, green, blue) for value, red, green, blue in rows]
    return replace(color, stops=tuple(sorted([*kept, *added])))


def raise_value(opacity: OpacityTF, value: float, width: float, reach: Range) -> OpacityTF:
    """Double the opacity in a range of values; scale whole modes by their share there.

    If no mode is near the given one of them, add one of opacity .05. The width is a standard
    deviation, also of the range's flanks.
    """
    is_there = float(opacity(value)) > TINY if opacity.points else _is_near(opacity, value, width)
    if not is_there:
        return add_mode(opacity, value, width, LEAST_RAISE)
    return _scaled(opacity, reach, width, STEP)


def lower_value(opacity: OpacityTF, _value: float, width: float, reach: Range) -> OpacityTF:
    """Halve the opacity in a range: the inverse of :func:`raise_value` within its limits."""
    return _scaled(opacity, reach, width, 1 / STEP)


def raised(opacity: OpacityTF, factor: float) -> OpacityTF:
    """Multiply all opacities by a factor, up to 1."""
    modes = tuple(replace(m, amplitude=min(factor * m.amplitude, 1.0)) for m in opacity.modes)
    points = tuple((value, min(factor * height, 1.0)) for value, height in opacity.points)
    return replace(opacity, modes=modes, points=points)


def isolate_value(opacity: OpacityTF, value: float, width: float, reach: Range) -> OpacityTF:
    """Keep only the opacity of values in a range, as a curve.

    The curve is at least as wide as the given width, in the data's units. Its flanks are as wide,
    or a quarter of the range. If the range has no opacity, one mode is added at the value.
    """
    if opacity(np.linspace(*reach, TF_SAMPLES)).max() <= TINY:
        return replace(opacity, modes=(_mode(value, width, LEAST_RAISE),), points=())
    middle, size = sum(reach) / 2, max(reach[1] - reach[0], width)
    flank = min(width, size / 4)
    half = (size - flank) / 2
    reach = middle - half, middle + half
    return replace(opacity, modes=(), points=_between(opacity, reach, flank))


def cut_to(opacity: OpacityTF, reach: Range) -> OpacityTF:
    """Keep the opacity of values in a range, as a curve; those beyond become transparent.

    The curve falls to 0 within a bin, or half of a narrower range. Beyond an end of the scalar
    range there is nothing to cut.
    """
    (lo, hi), (low, high) = opacity.scalar_range, reach
    if low <= lo and hi <= high:
        return opacity
    curve = opacity if opacity.points else as_curve(opacity)
    width = min(opacity.bin_width, (high - low) / 2)
    return replace(curve, points=_between(curve, reach, width))


def _mode(value: float, width: float, height: float) -> GaussianMode:
    """Return a mode whose standard deviation is a width."""
    return GaussianMode(value, math.sqrt(2) * width, height)


def _is_near(opacity: OpacityTF, value: float, width: float) -> bool:
    """Whether a value is within a mode's width, or within the edit's width of its mean."""
    reaches = ((mode, max(mode.width, math.sqrt(2) * width)) for mode in opacity.modes)
    return any(abs(mode.mean - value) <= reach and mode.amplitude > TINY for mode, reach in reaches)


def _scaled(opacity: OpacityTF, reach: Range, width: float, factor: float) -> OpacityTF:
    """Multiply the opacity in a range; whole modes by powers of the factor."""
    if opacity.points:
        return _reshaped(opacity, reach, width, factor)
    modes = []
    for mode in opacity.modes:
        flank = math.hypot(mode.width, math.sqrt(2) * width)
        weight = math.exp(-((float(_distance(mode.mean, reach)) / flank) ** 2))
        modes.append(replace(mode, amplitude=min(mode.amplitude * factor**weight, 1.0)))
    return replace(opacity, modes=tuple(modes))


def _between(opacity: OpacityTF, reach: Range, width: float) -> tuple[tuple[float, float], ...]:
    """Points of a curve between two values, with flanks whose middles are these values."""
    (lo, hi), (low, high) = opacity.scalar_range, reach
    half = width / 2
    # Beyond an end of the scalar range there is nothing to cut.
    first, last = low + half if low - half > lo else lo, high - half if high + half < hi else hi
    places = np.linspace(first, last, MODES_POINTS)
    own = opacity.points or _pairs(places, opacity(places))
    inside = [point for point in own if first < point[0] < last]
    ends = [(end, float(opacity(end))) for end in (first, last)]
    # The range's ends always have a point.
    zeros = {(end, 0.0) for end in (lo, low - half, high + half, hi) if not first <= end <= last}
    curve = [ends[0], *inside, ends[1], *(zero for zero in zeros if lo <= zero[0] <= hi)]
    # Points at one value, a jump, keep their order.
    return tuple(sorted(curve, key=lambda point: point[0]))


def _reshaped(opacity: OpacityTF, reach: Range, width: float, factor: float) -> OpacityTF:
    """Multiply a curve of points by a factor in a range."""
    values = _values_around(opacity, reach, width)
    weights = np.exp(-((_distance(values, reach) / width) ** 2) / 2)
    before = opacity(values)
    after = np.minimum(before * factor**weights, 1.0)
    return opacity if (after == before).all() else replace(opacity, points=_pairs(values, after))


def _distance(values: ArrayLike, reach: Range) -> NDArray[np.float64]:
    """Distance of values to a range; 0 in it."""
    return np.abs(np.asarray(values) - np.clip(values, *reach))


def _values_around(opacity: OpacityTF, reach: Range, width: float) -> NDArray[np.float64]:
    """Values of the curve's points, and of some more at the flanks of a range."""
    lo, hi = opacity.scalar_range
    flank = width * np.linspace(0, 2.5, 4)
    more = np.concatenate([reach[0] - flank, reach[1] + flank])
    inside = more[(more > lo) & (more < hi)]
    together = np.union1d([point[0] for point in opacity.points], inside)
    # Points closer than a quarter of a bin would be hard to hit, and change nothing.
    least = (hi - lo) / (4 * TF_SAMPLES)
    kept = np.concatenate([[True], np.diff(together) > least])
    kept[-1] = True
    return np.asarray(together[kept])


def _pairs(
    values: NDArray[np.float64], heights: NDArray[np.floating]
) -> tuple[tuple[float, float], ...]:
    return tuple(zip(values.tolist(), np.clip(heights, 0, 1).tolist(), strict=True))
