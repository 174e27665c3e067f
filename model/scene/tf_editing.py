"""Edits of transfer functions (TFs) as pure functions from TFs to TFs.

The handles of an opacity TF are its modes' peaks, or the points of a free
curve; those of a colour TF are its stops. Handles are identified by index.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF

_Item = TypeVar("_Item")

NEW_MODE_WIDTH = 1 / 25
"""Width of an added mode, as a fraction of the scalar range."""


def opacity_handles(opacity: OpacityTF) -> list[tuple[float, float]]:
    """Return the scalar value and opacity of every handle."""
    if opacity.points:
        return list(opacity.points)
    return [(mode.mean, mode.amplitude) for mode in opacity.modes]


def move_opacity_handle(opacity: OpacityTF, index: int, value: float, height: float) -> OpacityTF:
    """Move a handle within the scalar range, and a point between its neighbours only.

    A mode outside the range, made for another volume, cannot move farther away.
    """
    height = _clamp(height, 0.0, 1.0)
    if opacity.points:
        points = list(opacity.points)
        limits = _room([p[0] for p in points], index)
        points[index] = (_clamp(value, *limits), height)
        return replace(opacity, points=tuple(points))
    lo, hi = opacity.scalar_range
    now = opacity.modes[index].mean
    mean = _clamp(value, min(lo, now), max(hi, now))
    return _with_mode(opacity, index, replace(opacity.modes[index], mean=mean, amplitude=height))


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
    """Return True unless the handle is one of the two ends of a free curve."""
    return not opacity.points or 0 < index < len(opacity.points) - 1


def remove_opacity_handle(opacity: OpacityTF, index: int) -> OpacityTF:
    """Remove a mode or a point; keep the ends of a free curve."""
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
    limits = _room([s[0] for s in color.stops], index)
    stops = list(color.stops)
    stops[index] = (_clamp(value, *limits), *stops[index][1:])
    return replace(color, stops=tuple(stops))


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


def _without(items: tuple[_Item, ...], index: int) -> tuple[_Item, ...]:
    return items[:index] + items[index + 1 :]


def _room(values: list[float], index: int) -> tuple[float, float]:
    """Limits between which values stay sorted; the first and the last value are fixed."""
    if index in (0, len(values) - 1):
        return values[index], values[index]
    return values[index - 1], values[index + 1]


def _clamp(value: float, lo: float, hi: float) -> float:
    return min(max(value, lo), hi)
