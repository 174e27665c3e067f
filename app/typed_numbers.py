"""Reading of numbers as people type them, with thousands set apart, decimal commas and units."""

from __future__ import annotations

import math
import re

GAPS = " \N{NO-BREAK SPACE}\N{THIN SPACE}\N{NARROW NO-BREAK SPACE}'\N{RIGHT SINGLE QUOTATION MARK}_"
"""What sets thousands apart besides comma and point."""

MINUS = "\N{MINUS SIGN}"

NUMBER_CHARACTERS = set(f"0123456789+-{MINUS}.,eE{GAPS}")
"""Characters of which numbers are typed."""

_GROUPED = r"[+-]?\d{1,3}(?:%s\d{3})+"
_PLAIN = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_MARK = {",": "comma", ".": "point"}


def without_unit(text: str, unit: str) -> str:
    """Return what was typed without the unit at its end, such as "px".

    A box may show its unit already where somebody types it.
    """
    typed, unit = text.strip(), unit.strip()
    while unit and typed.lower().endswith(unit.lower()):
        typed = typed[: -len(unit)].rstrip()
    return typed


def read_number(text: str, whole: bool = False) -> float:
    """Read a typed number.

    Thousands may be set apart by spaces, apostrophes, commas or points: where both of the last
    two are there, the last one is the decimal sign. A single comma is a decimal comma, and a
    single point a decimal point, but in whole numbers.

    Parameters
    ----------
    whole : bool
        Whether it shall be a whole number.

    Returns
    -------
    float
        Finite.

    Raises
    ------
    ValueError
        When it is no number, or might be either of two; the message is a sentence for the user.
    """
    typed = text.strip().replace(MINUS, "-")
    if not typed:
        raise ValueError("Type a number.")
    plain = _without_thousands(typed, whole)
    if not _PLAIN.fullmatch(plain):
        raise ValueError(f"“{typed}” is not a number.")
    number = float(plain)
    if not math.isfinite(number):
        raise ValueError(f"“{typed}” is too large.")
    if whole and number != round(number):
        raise ValueError(f"“{typed}” is not a whole number.")
    return number


def _without_thousands(typed: str, whole: bool) -> str:
    """Return a number with a decimal point, if any, and nothing that sets thousands apart."""
    gaps = set(typed) & set(GAPS)
    if gaps:
        gap = re.escape(gaps.pop())
        if gaps or not re.fullmatch(_GROUPED % gap + r"(?:[.,]\d*)?", typed):
            raise ValueError(f"“{typed}” is not one number: gaps go between thousands only.")
        return re.sub(gap, "", typed).replace(",", ".")
    last = max(",.", key=typed.rfind)
    other = "." if last == "," else ","
    if other in typed:
        head, _, tail = typed.rpartition(last)
        if not re.fullmatch(_GROUPED % re.escape(other), head):
            raise ValueError(f"“{typed}” has a {_MARK[other]} where no thousands end.")
        return f"{head.replace(other, '')}.{tail}"
    grouped = bool(re.fullmatch(_GROUPED % re.escape(last), typed))
    if typed.count(last) > 1 or (whole and grouped):
        if not grouped:
            raise ValueError(f"“{typed}” has a {_MARK[last]} where no thousands end.")
        return typed.replace(last, "")
    if last == "," and grouped and not typed.lstrip("+-").startswith("0"):
        small, large = typed.replace(",", "."), typed.replace(",", "")
        raise ValueError(f"“{typed}” may be {large} or {float(small):g}: type one of these.")
    return typed.replace(",", ".")
