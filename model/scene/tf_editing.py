"""Edits of transfer functions (TFs) as pure functions from TFs to TFs.

The handles of an opacity TF are its modes' peaks, or the points of a free
curve; those of a colour TF are its stops. Handles are identified by index.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from model.scene.random_inputs import MAX_MODES
from model.scene.transfer_function import (
    TF_SAMPLES,
    ColorTF,
    GaussianMode,
    OpacityTF,
    TransferFunction,
)

_Item = TypeVar("_Item")

NEW_MODE_WIDTH = 1 / 25  # width of an added mode, as a fraction of the scalar range


def opacity_handles(opacity: OpacityTF) -> list[tuple[float, float]]:
    """Return the scalar value and opacity of every handle."""
    if opacity.points:
        return list(opacity.points)
    return [(mode.mean, mode.amplitude) for mode in opacity.modes]


def move_opacity_handle(opacity: OpacityTF, index: int, value: float, height: float) -> OpacityTF:
    """Move a handle within the scalar range, and a point between its neighbours only."""
    height = _clamp(height, 0.0, 1.0)
    place = _clamp(value, *opacity_limits(opacity, index))
    if opacity.points:
        points = list(opacity.points)
        points[index] = (place, height)
        return replace(opacity, points=tuple(points))
    return _with_mode(opacity, index, replace(opacity.modes[index], mean=place, amplitude=height))


def opacity_limits(opacity: OpacityTF, index: int) -> tuple[float, float]:
    """Limits of a handle's value in :func:`move_opacity_handle`."""
    if opacity.points:
        values = [point[0] for point in opacity.points]
        return _room(values, index, _fixed_ends(opacity), opacity.scalar_range)
    (lo, hi), now = opacity.scalar_range, opacity.modes[index].mean
    return min(lo, now), max(hi, now)


def move_opacity_handles(
    opacity: OpacityTF, indices: Sequence[int], shift: float, lift: float
) -> OpacityTF:
    """Move handles together by differences in value and opacity, as far as all can go."""
    handles = opacity_handles(opacity)
    lift = _within(lift, [(-handles[i][1], 1.0 - handles[i][1]) for i in indices])
    if opacity.points:
        values, fixed = [point[0] for point in handles], _fixed_ends(opacity)
        shift = _within(shift, _rooms(values, indices, fixed, opacity.scalar_range))
        shifts = [0.0 if i in fixed else shift for i in indices]
    else:
        lo, hi = opacity.scalar_range
        # A mode outside the range, from another volume, cannot move farther away.
        rooms = [(min(lo - handles[i][0], 0.0), max(hi - handles[i][0], 0.0)) for i in indices]
        shift = _within(shift, rooms)
        shifts = [shift for _ in indices]
    # Sorted in the direction of the move, so that no point is stopped by another moving one.
    for index, by in sorted(zip(indices, shifts, strict=True), reverse=shift > 0):
        value, height = handles[index]
        opacity = move_opacity_handle(opacity, index, value + by, height + lift)
    return opacity


def resize_mode(opacity: OpacityTF, index: int, width: float) -> OpacityTF:
    """Set a mode's width, from one bin to the whole range."""
    lo, hi = opacity.scalar_range
    width = _clamp(width, opacity.bin_width, hi - lo)
    return _with_mode(opacity, index, replace(opacity.modes[index], width=width))


def add_opacity_handle(opacity: OpacityTF, value: float, height: float) -> tuple[OpacityTF, int]:
    """Add a mode, or a point to a free curve; return the TF and the new handle's index."""
    lo, hi = opacity.scalar_range
    value, height = _clamp(value, lo, hi), _clamp(height, 0.0, 1.0)
    if opacity.points:
        index = sum(p[0] <= value for p in opacity.points)
        points = (*opacity.points[:index], (value, height), *opacity.points[index:])
        return replace(opacity, points=points), index
    mode = GaussianMode(value, NEW_MODE_WIDTH * (hi - lo), height)
    return replace(opacity, modes=(*opacity.modes, mode)), len(opacity.modes)


def can_remove_opacity_handle(opacity: OpacityTF, index: int) -> bool:
    """Return True unless the handle is an end of a free curve that holds an end of the range."""
    points = opacity.points
    return not points or (len(points) > 2 and index not in _fixed_ends(opacity))


def remove_opacity_handle(opacity: OpacityTF, index: int) -> OpacityTF:
    """Remove a mode or a point; keep the ends of a free curve at the ends of the range."""
    if not can_remove_opacity_handle(opacity, index):
        return opacity
    if opacity.points:
        return replace(opacity, points=_without(opacity.points, index))
    return replace(opacity, modes=_without(opacity.modes, index))


def is_end_stop(color: ColorTF, index: int) -> bool:
    """Return True if a stop is one of the two fixed ones at the ends of the range."""
    return index in (0, len(color.stops) - 1)


def move_stop(color: ColorTF, index: int, value: float) -> ColorTF:
    """Move a stop between its neighbours; the end stops are fixed."""
    if is_end_stop(color, index):
        return color
    stops = list(color.stops)
    stops[index] = (_clamp(value, *stop_limits(color, index)), *stops[index][1:])
    return replace(color, stops=tuple(stops))


def stop_limits(color: ColorTF, index: int) -> tuple[float, float]:
    """Values between which :func:`move_stop` can move a stop; equal for an end stop."""
    values = [stop[0] for stop in color.stops]
    return _room(values, index, _both_ends(values), color.scalar_range)


def move_stops(color: ColorTF, indices: Sequence[int], shift: float) -> ColorTF:
    """Move stops together, as far as all of them can go; see :func:`move_stop`."""
    values = [stop[0] for stop in color.stops]
    rooms = _rooms(values, indices, _both_ends(values), color.scalar_range)
    shift = _within(shift, rooms)
    for index in sorted(indices, reverse=shift > 0):
        color = move_stop(color, index, values[index] + shift)
    return color


def follow_modes(before: TransferFunction, opacity: OpacityTF) -> TransferFunction:
    """Replace the opacity TF, and move colour stops along with the modes' means."""
    color, modes = before.color, before.opacity.modes
    if len(modes) != len(opacity.modes):
        return replace(before, opacity=opacity)
    reach = opacity.bin_width / 2
    first, *inner, last = color.stops
    values = [stop[0] for stop in inner]
    for old, new in zip(modes, opacity.modes, strict=True):
        near = [i for i, stop in enumerate(inner) if abs(stop[0] - old.mean) <= reach]
        if near and new.mean != old.mean:
            index = min(near, key=lambda i: abs(inner[i][0] - old.mean))
            values[index] = _clamp(new.mean, first[0], last[0])
    moved = [(value, *stop[1:]) for value, stop in zip(values, inner, strict=True)]
    moved.sort(key=lambda stop: stop[0])
    return TransferFunction(opacity, replace(color, stops=(first, *moved, last)))


def recolor_stop(color: ColorTF, index: int, rgb: tuple[float, float, float]) -> ColorTF:
    """Set a stop's colour, components in 0..1."""
    stops = list(color.stops)
    stops[index] = (stops[index][0], *rgb)
    return replace(color, stops=tuple(stops))


def add_stop(color: ColorTF, value: float) -> tuple[ColorTF, int]:
    """Add a stop with the present colour at a value; return the TF and the stop's index."""
    value = _clamp(value, *color.scalar_range)
    index = min(max(sum(s[0] <= value for s in color.stops), 1), len(color.stops) - 1)
    red, green, blue = (float(c) for c in color(value))
    stops = (*color.stops[:index], (value, red, green, blue), *color.stops[index:])
    return replace(color, stops=stops), index


def remove_stop(color: ColorTF, index: int) -> ColorTF:
    """Remove a stop; keep the end stops."""
    if is_end_stop(color, index):
        return color
    return replace(color, stops=_without(color.stops, index))


def _with_mode(opacity: OpacityTF, index: int, mode: GaussianMode) -> OpacityTF:
    modes = list(opacity.modes)
    modes[index] = mode
    return replace(opacity, modes=tuple(modes))


def _within(wanted: float, rooms: list[tuple[float, float]]) -> float:
    """Nearest difference within all intervals, each of which contains 0."""
    low = max((room[0] for room in rooms), default=0.0)
    high = min((room[1] for room in rooms), default=0.0)
    return _clamp(wanted, min(low, 0.0), max(high, 0.0))


def _both_ends(values: Sequence[float]) -> frozenset[int]:
    return frozenset((0, len(values) - 1))


def _fixed_ends(opacity: OpacityTF) -> frozenset[int]:
    """End points of a free curve at or beyond the range's ends: they set the opacity there."""
    (lo, hi), points = opacity.scalar_range, opacity.points
    low = {0} if points[0][0] <= lo else set()
    high = {len(points) - 1} if points[-1][0] >= hi else set()
    return frozenset(low | high)


def _rooms(
    values: list[float],
    indices: Sequence[int],
    fixed: frozenset[int],
    scalar_range: tuple[float, float],
) -> list[tuple[float, float]]:
    """Interval of common moves before one value meets a fixed one or leaves the range."""
    moving = {i for i in indices if i not in fixed}
    rooms = []
    for i in moving:
        low, high = _room(values, i, fixed, scalar_range)
        low = -math.inf if i - 1 in moving else low - values[i]
        rooms.append((low, math.inf if i + 1 in moving else high - values[i]))
    return rooms


def _without(items: tuple[_Item, ...], index: int) -> tuple[_Item, ...]:
    return items[:index] + items[index + 1 :]


def _room(
    values: list[float], index: int, fixed: frozenset[int], scalar_range: tuple[float, float]
) -> tuple[float, float]:
    """Limits that keep values sorted and within the range; fixed ones cannot move."""
    if index in fixed:
        return values[index], values[index]
    low = values[index - 1] if index > 0 else scalar_range[0]
    high = values[index + 1] if index < len(values) - 1 else scalar_range[1]
    return low, high


def _clamp(value: float, lo: float, hi: float) -> float:
    return min(max(value, lo), hi)


CURVE_ERROR = 0.02
"""Largest difference in the square root of opacity between samples and a curve of few points.

The root, as a faint haze over many values is more visible than a small difference at a peak."""

LEAST_AMPLITUDE = 0.002  # opacity below which no mode is fitted: over many voxels, more shows


def as_curve(opacity: OpacityTF) -> OpacityTF:
    """Return a free curve of few points through an opacity TF's samples."""
    values = np.linspace(*opacity.scalar_range, TF_SAMPLES)
    samples = tuple(zip(values.tolist(), opacity(values).tolist(), strict=True))
    return fitted_curve(replace(opacity, modes=(), points=samples))


def fitted_curve(opacity: OpacityTF) -> OpacityTF:
    """Return a free curve of few points through one of many (Ramer, Douglas, Peucker)."""
    if len(opacity.points) < 3:
        return opacity
    values, heights = np.array(opacity.points).T
    kept = {0, len(values) - 1}
    # A jump, two points at one value, stays a jump.
    jumps = np.flatnonzero(np.diff(values) == 0)
    kept.update(jumps.tolist(), (jumps + 1).tolist())
    ends = sorted(kept)
    open_parts = [*pairwise(ends)]
    while open_parts:
        first, last = open_parts.pop()
        if last - first < 2:
            continue
        inside = slice(first + 1, last)
        line = np.interp(values[inside], values[[first, last]], heights[[first, last]])
        errors = np.abs(np.sqrt(heights[inside]) - np.sqrt(line))
        if errors.max() > CURVE_ERROR:
            middle = first + 1 + int(errors.argmax())
            kept.add(middle)
            open_parts += [(first, middle), (middle, last)]
    points = tuple(opacity.points[index] for index in sorted(kept))
    return replace(opacity, points=points)


def fitted_modes(opacity: OpacityTF) -> OpacityTF:
    """Return Gaussian modes that approximate an opacity TF; none if it is nearly empty.

    Modes are added where most is missing; after each, all are fitted by least squares. The soft
    loss limits the pull of a plateau's edges, which no mode can follow.
    """
    from scipy.optimize import least_squares

    wanted = opacity.sample().astype(np.float64)
    bins = np.arange(TF_SAMPLES, dtype=np.float64)
    # Means, widths (both in bins) and amplitudes, one row per mode.
    modes = np.empty((0, 3))
    for _ in range(MAX_MODES):
        missing = wanted - _sum(modes, bins)
        if missing.max() < LEAST_AMPLITUDE:
            break
        modes = np.concatenate([modes, _guess(missing)])
        lowest = np.tile([-TF_SAMPLES / 2, 1.0, 0.0], len(modes))
        highest = np.tile([1.5 * TF_SAMPLES, 2.0 * TF_SAMPLES, 1.0], len(modes))
        found = least_squares(
            lambda x: _sum(x.reshape(-1, 3), bins) - wanted,
            modes.ravel().clip(lowest + 1e-6, highest - 1e-6),
            bounds=(lowest, highest),
            x_scale=np.tile([10.0, 10.0, 0.1], len(modes)),
            loss="soft_l1",
            f_scale=0.05,
            max_nfev=60,
        )
        better = found.x.reshape(-1, 3)
        modes = better[better[:, 2] >= LEAST_AMPLITUDE / 2]
    lo, hi = opacity.scalar_range
    unit = (hi - lo) / (TF_SAMPLES - 1)
    rows = sorted(modes.tolist())
    found_modes = tuple(GaussianMode(lo + unit * m, unit * w, a) for m, w, a in rows)
    return replace(opacity, modes=found_modes, points=())


def _sum(modes: NDArray[np.float64], bins: NDArray[np.float64]) -> NDArray[np.float64]:
    means, widths, amplitudes = modes.T[:, :, None]
    return np.asarray((amplitudes * np.exp(-(((bins - means) / widths) ** 2))).sum(axis=0))


def _guess(missing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mode (1, 3) at the largest residual, as wide as its half height."""
    peak = int(missing.argmax())
    low = missing < missing[peak] / 2
    left = peak - next((i for i in range(1, peak + 1) if low[peak - i]), peak)
    right = peak + next(
        (i for i in range(1, TF_SAMPLES - peak) if low[peak + i]), TF_SAMPLES - peak
    )
    width = max((right - left) / (2 * np.sqrt(np.log(2))), 1.5)
    return np.array([[(left + right) / 2, width, missing[peak]]])
