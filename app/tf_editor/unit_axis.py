"""Axes of the plots: scalar values and opacities as positions and heights in 0..1.

Qt compares positions with a fixed tolerance and could not distinguish values of a
very small range, or of a range far from zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.number_box import MINUS
from model.scene.ranges import without_zero
from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale, logarithmic_ticks, values_at

_ROUND_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
_BEND_SHARE = 1e-3
_MOST_DECADES = 6
_LEAST_GAP = 0.09  # distance between the labels of a logarithmic axis, as a fraction of the axis
_FARTHEST = 4.0  # positions farther out count as equal, so that no value overflows
LEAST_SPAN = 1e-6  # smallest visible part of an axis, as a fraction
Scale = Literal["linear", "log", "symlog"]

WIDTHS: dict[ValueScale, str] = {"linear": "width", "log": "decades"}
"""Name of a mode's width, which is in powers of ten on a logarithmic scale."""


@dataclass(frozen=True)
class ScalarAxis:
    """Maps the visible scalar values to positions in 0..1, linearly or logarithmically.

    "log" needs values above zero; "symlog" is logarithmic on both sides of zero and linear near it.
    Both use an inverse hyperbolic sine. On a volume's logarithmic scale the values are logarithms:
    the axis is linear in them, but its labels show the original values.
    """

    visible: Range  # values at the positions 0 and 1
    full: Range  # all values that the axis may have to show
    scale: Scale = "linear"
    labels: ValueScale = "linear"
    numbers: Mapping[int, int] | None = None
    """The file's numbers for whole values if they differ; None if values are not whole."""

    @classmethod
    def over(
        cls,
        full: Range,
        logarithmic: bool = False,
        labels: ValueScale = "linear",
        numbers: Mapping[int, int] | None = None,
    ) -> ScalarAxis:
        """Return an axis that shows all of a range."""
        scale: Scale = "linear"
        if logarithmic and labels == "linear":
            scale = "log" if full[0] > 0 else "symlog"
        return cls(full, full, scale, labels, numbers)

    def showing(self, visible: Range) -> ScalarAxis:
        """Return an axis of the same scale that shows other values, moved to lie within `full`."""
        everything = replace(self, visible=self.full)
        low, high = everything.places(visible).tolist()
        span = max(high - low, LEAST_SPAN)
        if span >= 1:
            return everything
        low = min(max((low + high - span) / 2, 0.0), 1.0 - span)
        lo, hi = everything.values(np.array([low, low + span])).tolist()
        # Rounding leaves nothing between them in an interval that is far too narrow.
        return replace(self, visible=(lo, hi)) if lo < hi else self

    def places(self, values: ArrayLike) -> NDArray[np.float64]:
        """Return the positions of values of any shape; visible ones are in 0..1."""
        lo, hi = self._spaced(np.array(self.visible))
        return np.asarray((self._spaced(np.asarray(values, dtype=np.float64)) - lo) / (hi - lo))

    def values(self, places: ArrayLike) -> NDArray[np.float64]:
        """Return the values at positions of any shape; 0 and 1 give the visible ends exactly."""
        at = np.clip(np.asarray(places, dtype=np.float64), -_FARTHEST, _FARTHEST)
        lo, hi = self.visible
        if self.scale == "linear":
            found = lo * (1.0 - at) + hi * at
        else:
            first, last = self._spaced(np.array(self.visible))
            found = bend_for(self.full) * np.sinh(first * (1.0 - at) + last * at)
        # Rounding could give a value outside the visible interval.
        inside = (at >= 0) & (at <= 1)
        found = np.where(inside, np.clip(found, lo, hi), found)
        return np.where(at == 0, lo, np.where(at == 1, hi, found))

    def place(self, value: float) -> float:
        """Return the position of a value."""
        return float(self.places(value))

    def value(self, place: float) -> float:
        """Return the value at a position."""
        return float(self.values(place))

    def zoomed(self, factor: float, at: float = 0.5) -> ScalarAxis:
        """Return an axis zoomed by a factor; the value at a position stays there."""
        return self._between(at - at / factor, at + (1.0 - at) / factor)

    def shifted(self, by: float) -> ScalarAxis:
        """Return the axis moved to the right by a position, or to the left by a negative one."""
        first, last = self.places(self.full).tolist()
        by = min(max(by, first), last - 1.0)
        return self._between(by, 1.0 + by)

    def marks(self, unit: str = "") -> list[tuple[float, str]]:
        """Return the visible ends and round values between them: positions and texts."""
        lo, hi = values_at(self.visible, self.labels).tolist()
        if self.numbers is not None and math.floor(hi) > math.ceil(lo):
            return self._whole_marks(math.ceil(lo), math.floor(hi), unit)
        # To about a ten-thousandth of the visible interval: more digits are noise.
        step = 10.0 ** math.floor(math.log10((hi - lo) / 10_000))
        digits = max(6, 4 + math.floor(math.log10(max(abs(lo), abs(hi)) / (hi - lo))))
        if self.labels == "log":
            ends = [_text(end, 4) for end in (lo, hi)]
        else:
            ends = [_text(round(end / step) * step, digits) for end in (lo, hi)]
        inner = ticks(self.visible, 9, self.labels)
        if self.scale != "linear":
            decades = self._decades()
            inner = decades if len(decades) > 2 else [(self.place(float(t)), t) for _, t in inner]
        inner = [(at, text) for at, text in inner if 0 < at < 1]
        found = [(0.0, ends[0]), *inner, (1.0, f"{ends[1]} {unit}".rstrip())]
        return [(at, text.replace("-", MINUS)) for at, text in found]

    def _whole_marks(self, first: int, last: int, unit: str) -> list[tuple[float, str]]:
        """Return the first and the last visible label, and some between them."""
        assert self.numbers is not None
        step = max(int(_round_step((last - first) / 9)), 1)
        chosen = [first, *range((first // step + 1) * step, last, step), last]
        texts = [f"{self.numbers.get(each, each)}".replace("-", MINUS) for each in chosen]
        texts[-1] = f"{texts[-1]} {unit}".rstrip()
        return [(self.place(each), text) for each, text in zip(chosen, texts, strict=True)]

    def _decades(self) -> list[tuple[float, str]]:
        """Zero and powers of ten, then 2 and 5 times those, as room allows."""
        lo, hi = self.visible
        bend = bend_for(self.full)
        largest = max(abs(lo), abs(hi))
        first, last = math.ceil(math.log10(bend)), math.floor(math.log10(largest))
        powers = [10.0**n for n in range(first, last + 1)]
        tens = [sign * power for power in reversed(powers) for sign in (1, -1)]
        more = [factor * ten for ten in tens for factor in (2, 5)]
        taken: list[tuple[float, str]] = []
        for value in (0.0, *tens, *more):
            place = self.place(value)
            if 0 <= place <= 1 and all(abs(place - at) >= _LEAST_GAP for at, _ in taken):
                taken.append((place, _text(value, 6)))
        return sorted(taken)

    def _between(self, first: float, last: float) -> ScalarAxis:
        lo, hi = self.values(np.array([first, last])).tolist()
        return self.showing((lo, hi)) if lo < hi else self

    def _spaced(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return values if self.scale == "linear" else np.arcsinh(values / bend_for(self.full))


def bend_for(scalar_range: Range) -> float:
    """Return the magnitude from which a range's axis is logarithmic, see :class:`ScalarAxis`."""
    lo, hi = scalar_range
    largest = max(abs(lo), abs(hi))
    return max(lo, largest * 10.0**-_MOST_DECADES) if lo > 0 else largest * _BEND_SHARE


def ticks(
    scalar_range: Range, count: int = 6, scale: ValueScale = "linear"
) -> list[tuple[float, str]]:
    """Choose about `count` round values within a range: linear positions and texts."""
    if scale == "log":
        return [(at, without_zero(text)) for at, text in logarithmic_ticks(scalar_range, count)]
    lo, hi = scalar_range
    step = _round_step((hi - lo) / count)
    numbers = np.arange(math.ceil(lo / step - 1e-9), math.floor(hi / step + 1e-9) + 1)
    # Enough digits to distinguish adjacent ticks, even far from zero.
    digits = max(6, 3 + math.floor(math.log10(max(abs(lo), abs(hi)) / step)))
    return [((float(n * step) - lo) / (hi - lo), _text(n * step, digits)) for n in numbers]


def _round_step(rough: float) -> float:
    """Return the smallest round number that is about as large as another."""
    power = 10.0 ** math.floor(math.log10(rough))
    return power * min(s for s in _ROUND_STEPS if s * power >= 0.999 * rough)


def _text(value: float, digits: int) -> str:
    """Format a value with at most this many digits, and never as "-0"."""
    return without_zero(f"{value + 0.0:.{digits}g}")


BEND = 0.002  # opacity below which the logarithmic scale is nearly linear, so that it includes 0
_TOP = math.asinh(1 / BEND)
_MARKED = {0.001: "", 0.01: ".01", 0.1: ".1"}
"""Labels of opacities between 0 and 1, but the smallest, which would overlap the 0."""


@dataclass(frozen=True)
class OpacityScale:
    """Maps opacities to heights in the plot and back, linearly or by an inverse hyperbolic sine."""

    logarithmic: bool = False

    def heights(self, opacities: ArrayLike) -> NDArray[np.float64]:
        """Return the heights of opacities of any shape, 0..1 for 0..1."""
        values = np.asarray(opacities, dtype=np.float64)
        return np.asarray(np.arcsinh(values / BEND) / _TOP) if self.logarithmic else values

    def height(self, opacity: float) -> float:
        """Return the height of an opacity."""
        return float(self.heights(opacity))

    def opacity(self, height: float) -> float:
        """Return the opacity at a height; outside 0..1, it is continued."""
        if not self.logarithmic:
            return height
        # Far above the plot, a hyperbolic sine would overflow.
        return BEND * math.sinh(min(max(height, -2.0), 2.0) * _TOP)

    def ticks(self) -> list[tuple[float, str]]:
        """Return heights and their labels."""
        if not self.logarithmic:
            return [(0, "0"), (0.5, ".5"), (1, "1")]
        between = [(self.height(opacity), text) for opacity, text in _MARKED.items()]
        return [(0, "0"), *between, (1, "1")]
