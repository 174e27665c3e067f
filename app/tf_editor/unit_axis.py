"""The plots' horizontal axis: the scalar range mapped to 0..1.

Qt compares positions with a fixed tolerance, so that data of a very small
range, or far from zero, would stick together if plotted as they are.
"""

from __future__ import annotations

import math

import numpy as np

from model.scene.transfer_function import Range

_ROUND_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


def to_unit(value: float, scalar_range: Range) -> float:
    """Map a scalar value to the axis: the range's ends become 0 and 1."""
    lo, hi = scalar_range
    return (value - lo) / (hi - lo)


def from_unit(place: float, scalar_range: Range) -> float:
    """Map a place on the axis to its scalar value, within the range; the ends come back exactly."""
    lo, hi = scalar_range
    value = lo * (1.0 - place) + hi * place
    # In a narrow range far from zero, rounding would lead out of it.
    return min(max(value, lo), hi) if 0 <= place <= 1 else value


def ticks(scalar_range: Range, count: int = 6) -> list[tuple[float, str]]:
    """Choose round values within the range.

    Parameters
    ----------
    scalar_range : tuple of float
    count : int
        About how many.

    Returns
    -------
    list of (place, text)
        Places on the axis, 0..1, and the values there.
    """
    lo, hi = scalar_range
    rough = (hi - lo) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = power * min(s for s in _ROUND_STEPS if s * power >= 0.999 * rough)
    numbers = np.arange(math.ceil(lo / step - 1e-9), math.floor(hi / step + 1e-9) + 1)
    # Enough digits to tell neighbours apart, however far from zero.
    digits = max(6, 3 + math.floor(math.log10(max(abs(lo), abs(hi)) / step)))
    return [(to_unit(float(n * step), scalar_range), _text(n * step, digits)) for n in numbers]


def _text(value: float, digits: int) -> str:
    """Shortest decimal text; no sign before a bare zero."""
    return f"{value + 0.0:.{digits}g}"
