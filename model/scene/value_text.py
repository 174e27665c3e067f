"""Scalar values as text, with no more digits than a transfer function tells apart."""

from __future__ import annotations

import math

from model.scene.transfer_function import TF_SAMPLES, Range
from model.scene.value_scale import ValueScale, value_at

PLAIN = 1e6, 1e-6
"""Numbers below the first, of bins above the second, are written without a power of ten."""


def value_text(value: float, scalar_range: Range, scale: ValueScale) -> str:
    """Write a scalar value to within one bin of a TF over its range.

    Parameters
    ----------
    value : float
        On the scale.
    scalar_range : tuple of float
        Lowest and highest value of the TF, on the scale.
    scale : {"linear", "log"}

    Returns
    -------
    str
        In the data's units, such as ``"-612"``, ``"0.61"`` or ``"2.33e-08"``.
    """
    low, high = scalar_range
    bin_width = (high - low) / (TF_SAMPLES - 1)
    if scale == "log":
        value = value_at(value, scale)
        bin_width = value * (value_at(bin_width, scale) - 1)
        low, high = value, value
    place = math.floor(math.log10(2 * bin_width))
    if bin_width > PLAIN[1] and max(abs(low), abs(high)) < PLAIN[0]:
        text = f"{value:.{max(-place, 0)}f}"
    else:
        digits = 1 if value == 0 else math.floor(math.log10(abs(value))) - place + 1
        text = f"{value:.{max(digits, 1)}g}"
    return text.removeprefix("-") if float(text) == 0 else text


def range_text(values: Range, scalar_range: Range, scale: ValueScale) -> str:
    """Write two scalar values as a range, such as ``"260 to 1,900"``; equal ones as one.

    Parameters
    ----------
    values : tuple of float
        Lowest and highest value, on the scale.
    scalar_range : tuple of float
        Lowest and highest value of the TF, on the scale.
    scale : {"linear", "log"}
    """
    low, high = (_with_thousands(value_text(value, scalar_range, scale)) for value in values)
    return low if low == high else f"{low} to {high}"


def _with_thousands(text: str) -> str:
    whole, point, rest = text.partition(".")
    return f"{int(whole):,}{point}{rest}" if whole.lstrip("-").isdigit() and whole != "-0" else text
