"""Peaks of a curve over scalar values, and the intervals where a region responds most."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.display import FLOOR, SMALL_EDIT


@dataclass(frozen=True)
class Peak:
    """A local maximum of a curve, or the middle of a plateau.

    The prominence is its height above the higher one of the two valleys that part it from higher
    peaks; `left` and `right` are interpolated indices where the curve is half of it lower.
    """

    place: int
    prominence: float
    left: float
    right: float


def find_peaks(curve: NDArray[np.floating], least_prominence: float) -> list[Peak]:
    """Find the peaks of a finite curve (n,) from some prominence on, from left to right.

    Its two ends are no peaks; pad it with zeros to make them so.
    """
    return [
        peak
        for place in _maxima(curve)
        if (peak := _measured(curve, place)).prominence >= least_prominence
    ]


def _maxima(curve: NDArray[np.floating]) -> list[int]:
    """Middles of the plateaus, of one sample or more, with lower samples on both sides."""
    starts = np.concatenate(([0], np.flatnonzero(np.diff(curve)) + 1))
    ends = np.concatenate((starts[1:], [len(curve)])) - 1
    levels = curve[starts]
    higher = (levels[1:-1] > levels[:-2]) & (levels[1:-1] > levels[2:])
    inner = np.flatnonzero(higher) + 1
    return [int(place) for place in (starts[inner] + ends[inner]) // 2]


def _measured(curve: NDArray[np.floating], place: int) -> Peak:
    height = curve[place]
    above = np.flatnonzero(curve > height)
    # The peak's territory: from the next higher sample on the left to that on the right.
    first = int(above[above < place].max(initial=-1)) + 1
    last = int(above[above > place].min(initial=len(curve))) - 1
    valley = max(curve[first : place + 1].min(), curve[place : last + 1].min())
    middle = height - (height - valley) / 2
    left = _crossing(curve, place, first, -1, middle)
    right = _crossing(curve, place, last, 1, middle)
    return Peak(place, float(height - valley), left, right)


def _crossing(curve: NDArray[np.floating], place: int, end: int, step: int, level: float) -> float:
    """Index, between samples, where the curve first falls to a level on its way to an end."""
    while place != end and curve[place] > level:
        place += step
    if curve[place] >= level:
        return float(place)
    inner = curve[place - step]
    return place - step * float((level - curve[place]) / (inner - curve[place]))


LEAST_SHARE = 0.05
"""Prominence of a peak, as a share of the highest value, from which it counts."""


@dataclass(frozen=True)
class Interval:
    """Scalar values around a peak of a region's responses, in the data's units.

    `low` and `high` are where the response is half of the peak's prominence lower. `response` is
    the change of the region's RMS pixel value by an edit that adds .01 of opacity at its peak;
    negative where it becomes darker.
    """

    value: float
    low: float
    high: float
    response: float

    def predicted(self, height: float) -> float:
        """Expected change of the region's pixels for a mode of this opacity, to first order."""
        return self.response * height / SMALL_EDIT


def strongest_intervals(
    responses: NDArray[np.floating],
    scalar_range: Range,
    count: int = 3,
    window: Range | None = None,
) -> tuple[Interval, ...]:
    """Find the strongest peaks of a region's responses (256,), the strongest first.

    There are none where no edit shows more than rounding. What goes on rising outside the window of
    values, all by default, has no peak inside. Responses are those of
    :func:`model.sensitivity.display.shown_responses`.
    """
    values = np.linspace(*scalar_range, TF_SAMPLES)
    low, high = window or scalar_range
    inside = np.flatnonzero((values >= low) & (values <= high))
    if not len(inside):
        return ()
    # Values outside the window count as the nearest one inside.
    places = np.clip(np.arange(TF_SAMPLES), inside[0], inside[-1])
    responses = np.nan_to_num(responses)[places]
    # Zeros at either end make a response that rises up to an end a peak, too.
    strength = np.pad(np.abs(responses), 1)
    highest = float(strength.max())
    if highest < FLOOR * SMALL_EDIT:
        return ()
    peaks = find_peaks(strength, LEAST_SHARE * highest)
    own = [peak for peak in peaks if places[peak.place - 1] == peak.place - 1]
    strongest = sorted(own, key=lambda peak: -strength[peak.place])[:count]
    bins = np.arange(TF_SAMPLES)

    def value_at(place: float) -> float:
        return float(np.interp(place - 1, bins, values))

    return tuple(
        Interval(
            float(values[peak.place - 1]),
            value_at(peak.left),
            value_at(peak.right),
            float(responses[peak.place - 1]),
        )
        for peak in strongest
    )
