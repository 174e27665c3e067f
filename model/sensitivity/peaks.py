"""Peaks of a curve over scalar values.

As :func:`scipy.signal.find_peaks` finds them, which the tests compare with; importing that
module would take as much memory as several volumes, and half a second of the window's start.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Peak:
    """A local maximum of a curve.

    Attributes
    ----------
    place : int
        Index of the maximum; of a plateau, its middle.
    prominence : float
        Height above the higher one of the two valleys that part it from higher peaks.
    left, right : float
        Interpolated indices where the curve is half of the prominence lower.
    """

    place: int
    prominence: float
    left: float
    right: float


def find_peaks(curve: NDArray[np.floating], least_prominence: float) -> list[Peak]:
    """Find the peaks of a curve, from left to right.

    Parameters
    ----------
    curve : ndarray, shape (n,)
        Finite. Its two ends are no peaks; pad it with zeros to make them so.
    least_prominence : float
        Prominence from which a peak counts.
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
