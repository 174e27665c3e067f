"""The plots' horizontal axis: the scalar range mapped to 0..1.

Qt compares positions with a fixed tolerance and could not distinguish values of a
very small range, or of a range far from zero.
"""

from __future__ import annotations

import math

import numpy as np

from model.scene.transfer_function import Range

_ROUND_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


def to_unit(value: float, scalar_range: Range) -> float:
    """Map a scalar value to the axis, and the range's ends to 0 and 1."""
    lo, hi = scalar_range
    return (value - lo) / (hi - lo)


def from_unit(place: float, scalar_range: Range) -> float:
    """Map a position on the axis to its scalar value; 0 and 1 give the range's ends exactly."""
    lo, hi = scalar_range
    value = lo * (1.0 - place) + hi * place
    # In a narrow range far from zero, rounding could give a value outside it.
    return min(max(value, lo), hi) if 0 <= place <= 1 else value


def ticks(scalar_range: Range, count: int = 6) -> list[tuple[float, str]]:
    """Choose round tick values within the range.

    Parameters
    ----------
    scalar_range : tuple of float
    count : int
        Approximate number of ticks.

    Returns
    -------
    list of (place, text)
        Positions on the axis, 0..1, and their values as text.
    """
    lo, hi = scalar_range
    rough = (hi - lo) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = power * min(s for s in _ROUND_STEPS if s * power >= 0.999 * rough)
    numbers = np.arange(math.ceil(lo / step - 1e-9), math.floor(hi / step + 1e-9) + 1)
    # Enough digits to distinguish adjacent ticks, even far from zero.
    digits = max(6, 3 + math.floor(math.log10(max(abs(lo), abs(hi)) / step)))
    return [(to_unit(float(n * step), scalar_range), _text(n * step, digits)) for n in numbers]


def _text(value: float, digits: int) -> str:
    """Format a value with at most this many digits, and never as "-0"."""
    return f"{value + 0.0:.{digits}g}"
