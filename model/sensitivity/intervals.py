"""Intervals of scalar values where an edit promises most, and what it promises."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.display import FLOOR, SMALL_EDIT

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


def promising_intervals(
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
    scalar_range : tuple of float
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
    # Imported here: the window starts without it.
    from scipy.signal import find_peaks, peak_widths

    # Zeros at either end make a response that rises up to an end a peak, too.
    strength = np.pad(np.abs(responses), 1)
    highest = float(strength.max())
    if highest < FLOOR * SMALL_EDIT:
        return ()
    peaks, found = find_peaks(strength, prominence=LEAST_SHARE * highest, plateau_size=1)
    own = np.flatnonzero(places[peaks - 1] == peaks - 1)
    order = own[np.argsort(-strength[peaks[own]], kind="stable")][:count]
    prominences = found["prominences"], found["left_bases"], found["right_bases"]
    _, _, lefts, rights = peak_widths(strength, peaks, 0.5, prominences)
    bins = np.arange(TF_SAMPLES)

    def value_at(place: float) -> float:
        return float(np.interp(place - 1, bins, values))

    return tuple(
        Interval(
            float(values[peaks[i] - 1]),
            value_at(lefts[i]),
            value_at(rights[i]),
            float(responses[peaks[i] - 1]),
        )
        for i in order
    )
