"""The scalar values that contribute to a place of the image: "what did I click on?"."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.peaks import find_peaks

SMOOTHING = 3.0
"""Standard deviation of the smoothing, in bins, so that noise is not many values."""

LEAST_SHARE = 0.05
"""Share of the place's visibility from which a value is named."""

CORE = 0.2
"""Part of a peak's height down to which the values around it are said to be of the peak."""

LEAST_FLANK = 0.08
"""Share of what lies beyond, on one side, from which it is named by itself."""

TAIL = 0.02
"""Share of what is visible of some values that is left out at either end of their range."""

SAME = 10
"""Most bins between a value and the one that it was before an edit."""


@dataclass(frozen=True)
class Contribution:
    """A scalar value that shows at a place of the image.

    Attributes
    ----------
    value : float
        In the data's units.
    share : float
        Its share, with the values around it, of the place's visibility, 0 to 1.
    reach : tuple of float
        The lowest and the highest of these values, without a fiftieth of the share at each end.
    """

    value: float
    share: float
    reach: Range


def contributions(
    visibility: NDArray[np.floating], scalar_range: Range
) -> tuple[Contribution, ...]:
    """Find the values that contribute most to a place: three at most, the largest share first.

    The visibility (256,) is that of :func:`model.sensitivity.exact.visibility`. Each peak counts
    with the values around it. A long flank, such as a haze of many values before a surface of one,
    is named by the value in its middle. A black place has no values.
    """
    total = float(visibility.sum())
    if not total > 1e-6:
        return ()
    # Imported here: the window starts without it.
    from scipy.ndimage import gaussian_filter1d

    smooth = np.pad(gaussian_filter1d(visibility.astype(np.float64), SMOOTHING, mode="nearest"), 1)
    peaks = [peak.place for peak in find_peaks(smooth, 0.02 * float(smooth.max()))]
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
        reach = _reach(visibility, values, own)
        found.append(Contribution(float(values[peak - 1]), share, reach))
        for a, b in (flank for flank, is_long in zip(flanks, kept, strict=True) if is_long):
            sums = np.cumsum(visibility[a:b].astype(np.float64))
            middle = a + int(np.searchsorted(sums, sums[-1] / 2))
            reach = _reach(visibility, values, slice(a, b))
            found.append(Contribution(float(values[middle]), float(sums[-1]) / total, reach))
    named = [one for one in found if one.share >= LEAST_SHARE]
    return tuple(sorted(named, key=lambda one: -one.share)[:3])


def percentages(found: Sequence[Contribution]) -> tuple[int, ...]:
    """Return shares in whole percent that add up to no more than all.

    Rounding alone could make 101 of them; it is the one that was rounded up most that gives way.
    """
    exact = [100 * one.share for one in found]
    whole = [round(share) for share in exact]
    while sum(whole) > max(100, math.ceil(sum(exact) - 1e-6)):
        most = max(range(len(whole)), key=lambda index: whole[index] - exact[index])
        whole[most] -= 1
    return tuple(whole)


def follow(
    before: tuple[Contribution, ...], found: tuple[Contribution, ...], scalar_range: Range
) -> tuple[Contribution, ...]:
    """List the values found now in the order in which they were listed before an edit.

    Each value of before keeps its place with its present share, 0 where it no longer shows; the
    others follow.
    """
    left, listed = list(found), []
    for old in before:
        near = [new for new in left if is_same_value(new.value, old.value, scalar_range)]
        new = min(near, key=lambda new: abs(new.value - old.value), default=None)
        if new is None:
            listed.append(Contribution(old.value, 0.0, old.reach))
        else:
            left.remove(new)
            listed.append(new)
    return (*listed, *left)


def is_same_value(one: float, other: float, scalar_range: Range) -> bool:
    """Whether two values are so near that an edit may have moved the one to the other."""
    return abs(one - other) <= SAME * (scalar_range[1] - scalar_range[0]) / (TF_SAMPLES - 1)


def _reach(visibility: NDArray[np.floating], values: NDArray[np.float64], part: slice) -> Range:
    """Lowest and highest value of a part, without its faint ends."""
    sums = np.cumsum(visibility[part].astype(np.float64))
    if not sums[-1] > 0:
        return float(values[part][0]), float(values[part][-1])
    low, high = np.searchsorted(sums, [TAIL * sums[-1], (1 - TAIL) * sums[-1]])
    return float(values[part][low]), float(values[part][min(high, len(sums) - 1)])


def _core(smooth: NDArray[np.float64], peak: int, first: int, last: int) -> tuple[int, int]:
    """Bins around a peak, from first to before last, where it is not far below its height."""
    low = high = peak
    while low > first and smooth[low - 1] >= CORE * smooth[peak]:
        low -= 1
    while high < last and smooth[high] >= CORE * smooth[peak]:
        high += 1
    return low, high
