"""Peaks of curves over scalar values: of a region's response, and of visibility at a place."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from model.scene.default_tf import find_peaks
from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.display import FLOOR, SMALL_EDIT

LEAST_SHARE = 0.05  # least prominence of a peak, as a share of the highest value


@dataclass(frozen=True)
class Interval:
    """Scalar values around a peak of a region's responses, in the data's units."""

    value: float
    low: float
    high: float  # where the response is lower by half of the peak's prominence
    response: float
    """Change of the region's RMS pixel value by an edit that adds .01 of opacity at its peak;
    negative if it becomes darker."""

    @property
    def reach(self) -> Range:
        """Its lowest and highest value."""
        return self.low, self.high

    def predicted(self, height: float) -> float:
        """Expected change of the region's pixels for a mode of this opacity, to first order."""
        return self.response * height / SMALL_EDIT


def strongest_intervals(
    responses: NDArray[np.floating],
    scalar_range: Range,
    count: int = 3,
    window: Range | None = None,
) -> tuple[Interval, ...]:
    """Find the strongest peaks of a region's displayed responses (256,), the strongest first.

    There are none if no edit exceeds rounding errors. A curve that rises on beyond the window of
    values (default: all) has no peak inside.
    """
    values = np.linspace(*scalar_range, TF_SAMPLES)
    low, high = window or scalar_range
    inside = np.flatnonzero((values >= low) & (values <= high))
    if not len(inside):
        return ()
    # Values outside the window count as the nearest one inside.
    places = np.clip(np.arange(TF_SAMPLES), inside[0], inside[-1])
    responses = np.nan_to_num(responses)[places]
    # Zeros at both ends make a maximum at an end a peak, too.
    strength = np.pad(np.abs(responses), 1)
    highest = float(strength.max())
    if highest < FLOOR * SMALL_EDIT:
        return ()
    intervals = []
    for place, *sides in find_peaks(strength, LEAST_SHARE * highest):
        if places[place - 1] == place - 1:
            low, high = np.interp(sides, np.arange(1, TF_SAMPLES + 1), values).tolist()
            value, response = values[place - 1], responses[place - 1]
            intervals.append(Interval(float(value), low, high, float(response)))
    return tuple(sorted(intervals, key=lambda interval: -abs(interval.response))[:count])


SMOOTHING = 3.0  # standard deviation of the smoothing in bins, so that noise gives no peaks
NAMED_SHARE = 0.05  # share of the place's visibility from which a value is named
CORE = 0.2  # share of a peak's height down to which the values around it belong to it
FOOT = 0.02  # share of its height down to which a peak's range reaches
LEAST_FLANK = 0.08  # share of the visibility beyond, on one side, from which it is a separate value
TAIL = 0.02  # share of some values' visibility that is omitted at either end of their range
SAME = 10  # most bins that an edit moves a value


@dataclass(frozen=True)
class Contribution:
    """A scalar value that is visible at a place of the image."""

    value: float  # in the data's units
    share: float  # its share, with the values around it, of the place's visibility, 0 to 1
    reach: Range  # lowest and highest of these values, without a fiftieth at each end


def contributions(
    visibility: NDArray[np.floating], scalar_range: Range
) -> tuple[Contribution, ...]:
    """Find the values that contribute most to a place: at most three, the largest share first.

    Each peak of the visibility (256,) includes the values around it. A long flank, such as a haze
    of many values in front of a surface, is listed by its middle value.
    """
    total = float(visibility.sum())
    if not total > 1e-6:
        return ()
    # Imported here: the window starts without it.
    from scipy.ndimage import gaussian_filter1d

    smooth = np.pad(gaussian_filter1d(visibility.astype(np.float64), SMOOTHING, mode="nearest"), 1)
    peaks = [place for place, *_ in find_peaks(smooth, 0.02 * float(smooth.max()))]
    valleys = [int(np.argmin(smooth[a : b + 1])) + a for a, b in pairwise(peaks)]
    edges = [0, *(valley - 1 for valley in valleys), TF_SAMPLES]
    values = np.linspace(*scalar_range, TF_SAMPLES)
    found = []
    for peak, (first, last) in zip(peaks, pairwise(edges), strict=True):
        low, high = _core(smooth[1:-1], peak - 1, first, last)
        flanks = [(first, low), (high, last)]
        kept = [float(visibility[a:b].sum()) / total >= LEAST_FLANK for a, b in flanks]
        own = slice(low if kept[0] else first, high if kept[1] else last)
        share = float(visibility[own].sum()) / total
        # Without the haze of another material far away.
        foot = _core(smooth[1:-1], peak - 1, own.start, own.stop, FOOT)
        reach = _reach(visibility, values, slice(*foot))
        found.append(Contribution(float(values[peak - 1]), share, reach))
        for a, b in (flank for flank, is_long in zip(flanks, kept, strict=True) if is_long):
            sums = np.cumsum(visibility[a:b].astype(np.float64))
            middle = a + int(np.searchsorted(sums, sums[-1] / 2))
            reach = _reach(visibility, values, slice(a, b))
            found.append(Contribution(float(values[middle]), float(sums[-1]) / total, reach))
    named = [one for one in found if one.share >= NAMED_SHARE]
    return tuple(sorted(named, key=lambda one: -one.share)[:3])


def percentages(found: Sequence[Contribution]) -> tuple[int, ...]:
    """Return shares in whole percent that add up to at most 100.

    If rounding gives 101, the share that was rounded up most is reduced.
    """
    exact = [100 * one.share for one in found]
    whole = [round(share) for share in exact]
    while sum(whole) > max(100, math.ceil(sum(exact) - 1e-6)):
        most = max(range(len(whole)), key=lambda index: whole[index] - exact[index])
        whole[most] -= 1
    return tuple(whole)


Found = TypeVar("Found", bound=Contribution | Interval)


def follow(
    before: tuple[Found, ...],
    found: tuple[Found, ...],
    scalar_range: Range,
    gone: Callable[[Found], Found],
) -> tuple[Found, ...]:
    """List the present values in their order before an edit, and those that are gone."""
    left, listed = [*found], list[Found]()
    for old in before:
        low, high = old.reach
        near = [
            new
            for new in left
            if low <= new.value <= high or is_same_value(new.value, old.value, scalar_range)
        ]
        new = min(near, key=lambda new: abs(new.value - old.value), default=None)
        if new is None:
            listed.append(gone(old))
        else:
            left.remove(new)
            listed.append(new)
    return tuple(listed + left)


def is_same_value(one: float, other: float, scalar_range: Range) -> bool:
    """Whether two values are so close that an edit may have moved one to the other."""
    return abs(one - other) <= SAME * (scalar_range[1] - scalar_range[0]) / (TF_SAMPLES - 1)


def _reach(visibility: NDArray[np.floating], values: NDArray[np.float64], part: slice) -> Range:
    """Lowest and highest value of a part, without its faint ends."""
    sums = np.cumsum(visibility[part].astype(np.float64))
    if not sums[-1] > 0:
        return float(values[part][0]), float(values[part][-1])
    low, high = np.searchsorted(sums, [TAIL * sums[-1], (1 - TAIL) * sums[-1]])
    return float(values[part][low]), float(values[part][min(high, len(sums) - 1)])


def _core(
    smooth: NDArray[np.float64], peak: int, first: int, last: int, share: float = CORE
) -> tuple[int, int]:
    """Bins around a peak down to a share of its height: first and last plus one."""
    low = high = peak
    while low > first and smooth[low - 1] >= share * smooth[peak]:
        low -= 1
    while high < last and smooth[high] >= share * smooth[peak]:
        high += 1
    return low, high
