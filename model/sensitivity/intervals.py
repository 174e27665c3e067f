"""Intervals of scalar values where a region responds most, and what is predicted there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.display import FLOOR, SMALL_EDIT
from model.sensitivity.peaks import find_peaks

LEAST_SHARE = 0.05
"""Prominence of a peak, as a share of the highest value, from which it counts."""


@dataclass(frozen=True)
class Interval:
    """Scalar values around a peak of a region's responses.

    Attributes
    ----------
    value : float
        Of the peak, in the data's units.
    low, high : float
        Where the response is half of the peak's prominence lower.
    response : float
        At the peak, in the displayed unit: the change of the region's RMS pixel value by
        an edit that adds .01 of opacity at its peak. Negative where it becomes darker.
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
    """Find the strongest peaks of a region's responses.

    Parameters
    ----------
    responses : ndarray, shape (256,)
        In the displayed unit; see :func:`model.sensitivity.display.shown_responses`.
    count : int
        Largest number of intervals.
    window : tuple of float, optional
        Values of interest; all, by default. What goes on rising outside has no peak inside.

    Returns
    -------
    tuple of Interval
        The strongest first; none where no edit shows more than rounding.
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
