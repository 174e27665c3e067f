"""Numbers as the window writes them: few digits, no zero before the point, a true minus sign."""

from __future__ import annotations

import math

MINUS = "\N{MINUS SIGN}"

SMALLEST, LARGEST = 1e-4, 1e5
MILLION = 1e6
"""Numbers between which no power of ten is written."""


def without_zero(number: str) -> str:
    """Leave out a zero before the point, as in ``"0.25"`` and ``"-0.25"``."""
    digits = number.lstrip("+-")
    return number.replace("0.", ".", 1) if digits.startswith("0.") else number


def short(number: float, digits: int = 2, *, signed: bool = False) -> str:
    """Write a number with few significant digits, such as ``".004"``, ``"−.02"`` or ``"2e−5"``."""
    size = abs(number)
    if SMALLEST <= size < 1:
        # A fifth decimal would be longer, and say nothing.
        size = round(size, 4)
    text = f"{size:.{digits}g}" if size < 10**digits else f"{size:.0f}"
    if 0 < size < SMALLEST or size >= LARGEST:
        digit, _, power = f"{size:.{digits - 1}e}".partition("e")
        text = f"{float(digit):g}e{int(power)}".replace("-", MINUS)
    else:
        text = without_zero(text)
    sign = "" if not size else MINUS if number < 0 else "+" if signed else ""
    return sign + text


def significant(number: float, digits: int) -> str:
    """Write a number with some significant digits at most, such as ``"2480"`` and ``"0.05"``.

    Whole digits are all written; there is no power of ten from .0001 to a million.
    """
    size = abs(number)
    if not size or not SMALLEST <= size < MILLION:
        return f"{number + 0.0:.{digits}g}"
    text = f"{number:.{max(digits - 1 - math.floor(math.log10(size)), 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
