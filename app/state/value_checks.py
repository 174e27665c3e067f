"""Checks of single values that come from a file.

A check takes a value and returns it as it is to be used, or raises :class:`ValueError`.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from typing import Any

Check = Callable[[Any], Any]
Checks = Mapping[str, Check]


def valid_values(checks: Checks, data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the valid values, without the wrong ones, and the unknown ones as "others"."""
    found: dict[str, Any] = {"others": {}}
    for name, value in data.items():
        if name not in checks:
            found["others"][name] = value
            continue
        try:
            found[name] = checks[name](value)
        except ValueError:
            continue
    return found


def checked(checks: Checks, name: str, value: Any) -> Any:
    """Return a value, or raise :class:`ValueError` with its name."""
    if name not in checks:
        raise ValueError(f"Nothing called '{name}' is remembered.")
    try:
        return checks[name](value)
    except ValueError as error:
        raise ValueError(f"'{name}' cannot be {value!r}: {error}.") from error


def one_of(*allowed: Any) -> Check:
    """Return a check that a value is one of some."""

    def check(value: Any) -> Any:
        # By type, too: 1 is True to Python.
        if not any(value == each and type(value) is type(each) for each in allowed):
            raise ValueError(f"it must be one of {allowed}")
        return value

    return check


flag = one_of(False, True)
"""Check that a value is true or false."""


def number(lowest: float, highest: float) -> Callable[[Any], float]:
    """Return a check that a value is a number in a range."""

    def check(value: Any) -> float:
        if type(value) not in (int, float):
            raise ValueError("it must be a number")
        # Not a number is in no range.
        if not lowest <= value <= highest:
            raise ValueError(f"it must be from {lowest:g} to {highest:g}")
        return float(value)

    return check


def whole_number(lowest: int, highest: int) -> Callable[[Any], int]:
    """Return a check that a value is a whole number in a range."""

    def check(value: Any) -> int:
        if type(value) is not int or not lowest <= value <= highest:
            raise ValueError(f"it must be a whole number from {lowest} to {highest}")
        return value

    return check


def text(value: Any) -> str:
    """Check that a value is text."""
    if not isinstance(value, str):
        raise ValueError("it must be text")
    return value


def base64_text(value: Any) -> str:
    """Check that a value is bytes in base64."""
    base64.b64decode(text(value), validate=True)
    return text(value)


def either(*checks: Check) -> Check:
    """Return a check that a value passes one of some checks."""

    def check(value: Any) -> Any:
        for each in checks[:-1]:
            try:
                return each(value)
            except ValueError:
                continue
        return checks[-1](value)

    return check


def list_of(check: Check, most: int) -> Callable[[Any], tuple[Any, ...]]:
    """Return a check of each value of a list, of which the first ones are taken, as a tuple."""

    def check_all(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple):
            raise ValueError("it must be a list")
        return tuple(check(each) for each in value[:most])

    return check_all


def valid_of(check: Check, most: int) -> Callable[[Any], tuple[Any, ...]]:
    """Return a check that takes the valid values of a list, of which the last ones are taken."""

    def check_each(value: Any) -> tuple[Any, ...]:
        if not isinstance(value, list | tuple):
            raise ValueError("it must be a list")
        found = []
        for each in value[-most:]:
            try:
                found.append(check(each))
            except ValueError:
                continue
        return tuple(found)

    return check_each


def dict_of(check: Check, most: int) -> Callable[[Any], dict[str, Any]]:
    """Return a check of each value of a dict, of which the last ones are taken."""

    def check_all(value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise ValueError("it must have names")
        newest = list(value.items())[-most:]
        return {text(name): check(each) for name, each in newest}

    return check_all
