"""The conventions by which NetCDF files, and others like them, describe arrays (CF)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.volume_files.arrays import attribute_number, attribute_numbers, attribute_text

EVEN = 1e-2
"""Relative difference up to which steps of a coordinate count as equal."""


def described(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return fill values, valid range, scaling and units of an array, by its attributes.

    Returns
    -------
    dict
        Fields of :class:`~model.volume_files.arrays.StoredArray`.
    """
    fills = [
        number
        for name in ("_FillValue", "missing_value")
        for number in attribute_numbers(attributes, name)
    ]
    slope = attribute_number(attributes, "scale_factor")
    intercept = attribute_number(attributes, "add_offset")
    low = attribute_number(attributes, "valid_min")
    high = attribute_number(attributes, "valid_max")
    both = attribute_numbers(attributes, "valid_range")
    valid = None
    if len(both) == 2:
        valid = both[0], both[1]
    elif low is not None or high is not None:
        valid = -np.inf if low is None else low, np.inf if high is None else high
    if valid is not None and not valid[0] < valid[1]:
        valid = None
    units = attribute_text(attributes, "units")
    return {
        "fills": tuple(dict.fromkeys(fills)),
        "valid": valid,
        "slope": 1.0 if slope in (None, 0.0) else slope,
        "intercept": intercept or 0.0,
        "units": "" if units == "1" else units,
    }


def placed(axes: Iterable[tuple[str, NDArray[Any] | None, str]]) -> dict[str, Any]:
    """Return steps, units and starts of axes by their coordinates, as :func:`described` does.

    Parameters
    ----------
    axes : iterable of (str, ndarray or None, str)
        Name, coordinates, shape (n,), and their unit; None for an axis without any.
    """
    nothing: tuple[float | None, float, str, tuple[str, ...]] = None, 0.0, "", ()
    found = [
        nothing if values is None else _coordinate_step(values, unit, name)
        for name, values, unit in axes
    ]
    return {
        "steps": tuple(step for step, _, _, _ in found),
        "starts": tuple(start for _, start, _, _ in found),
        "units_of_steps": tuple(unit for _, _, unit, _ in found),
        "notes": tuple(note for _, _, _, notes in found for note in notes),
    }


def _coordinate_step(
    values: NDArray[Any], units: str, name: str
) -> tuple[float | None, float, str, tuple[str, ...]]:
    """Return step, start and unit of an axis by the coordinates along it, and notes."""
    numbers = np.asarray(values, np.float64)
    if numbers.ndim != 1 or len(numbers) < 2 or not np.isfinite(numbers).all():
        return None, 0.0, "", ()
    steps = np.diff(numbers)
    step = float(np.median(steps))
    if step == 0 or not ((steps > 0).all() or (steps < 0).all()):
        return None, 0.0, "", ()
    notes: tuple[str, ...] = ()
    if np.abs(steps - step).max() > EVEN * abs(step):
        least, most = sorted((abs(steps[0]), abs(steps[-1])))
        least, most = min(least, np.abs(steps).min()), max(most, np.abs(steps).max())
        notes = (
            f"The values along '{name}' are {least:g} to {most:g} apart; "
            f"{abs(step):g} is used for all.",
        )
    return step, float(numbers[0]), units, notes
