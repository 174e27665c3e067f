"""A stack of DICOM images as a grid: their order, distances and shear, and their values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.file_facts import FileFacts
from model.volume_files.checks import check_grid
from model.volume_files.dicom_pixels import bits_stored, padding_mask, stored_pixels, stored_type
from model.volume_files.dicom_stack import Stack, heights
from model.volume_files.dicom_tags import Frame, numbers_of, value_of
from model.volume_files.frame import (
    axis_labels,
    frame_notes,
    unit_directions,
    usable_origin,
    usable_spacing,
)
from model.volume_files.grid import Grid
from model.volume_files.progress import counted
from model.volume_files.upright import sheared_back

EVEN = 0.02
"""Relative difference below which slice distances count as equal."""

LEAST_TILT = 0.005
"""Shift of the slices, per distance, below which they lie behind one another."""

MOST_LISTED = 4
MOST_GAPS = 0.2
"""Share of the distances up to which larger ones are gaps, and no change of the distance."""


@dataclass(frozen=True, eq=False)
class _Order:
    """Images in the order of their places.

    The step is the distance of slices, None if unknown; the shear is the shift of each slice
    against the one before, along rows and columns in mm.
    """

    frames: list[Frame]
    step: float | None
    notes: tuple[str, ...] = ()
    shear: tuple[float, float] = (0.0, 0.0)


def read_stack(stack: Stack) -> Grid:
    """Read the images of a stack as a volume."""
    order = _ordered(stack)
    frames = order.frames
    first = frames[0]
    folder = first.file.path if len({f.file.path for f in frames}) == 1 else first.file.path.parent
    dtype = value_type(frames)
    check_grid(folder, (first.columns, first.rows, len(frames)), dtype)
    values = np.empty((len(frames), first.rows, first.columns), dtype)
    missing: NDArray[np.bool_] | None = None
    for z, frame in enumerate(counted("slices read", frames)):
        padding = _fill(values[z], frame)
        if padding is not None and padding.any():
            if missing is None:
                missing = np.zeros(values.shape, bool)
            missing[z] = padding
    spacing, spacing_notes = _spacing(order)
    origin = first.position or (0.0, 0.0, 0.0)
    shear_notes: tuple[str, ...] = ()
    if any(abs(shift) > LEAST_TILT * spacing[2] for shift in order.shear) and first.spacing:
        shear = order.shear[0] / spacing[0], order.shear[1] / spacing[1]
        values, missing, moved = sheared_back(values, missing, shear)
        axes = np.array(first.orientation).reshape(2, 3)
        origin = tuple(np.array(origin) - (np.array(moved) * spacing[:2]) @ axes)
        tilt = np.degrees(np.arctan2(np.hypot(*order.shear), spacing[2]))
        shear_notes = (
            f"The slices are shifted against one another, as by a gantry tilted by {tilt:.1f} "
            "degrees; they are sheared back to where they were taken.",
        )
    directions = _axes(first)
    notes = order.notes + shear_notes + spacing_notes + _kind_notes(first)
    placed = bool(first.orientation and first.position)
    return Grid(
        values,
        spacing,
        usable_origin(origin),
        _common_units(frames),
        notes + frame_notes(directions),
        axis_labels(directions, "LPS") if placed else (),
        missing=missing,
        facts=FileFacts(
            "DICOM",
            "mm" if first.spacing else "",
            unit_directions(directions) if placed else (),
            "LPS" if placed else "",
        ),
    )


def value_type(frames: Sequence[Frame]) -> np.dtype[np.generic]:
    """Type for all images' rescaled pixels: an integer type if the values are integers and fit."""
    stored = stored_type(frames[0])
    if stored.kind == "f":
        return stored
    if value_of(frames[0].file.tags, "ModalityLUTSequence"):
        return np.dtype(np.int32)
    scales = {(frame.slope, frame.intercept) for frame in frames}
    if scales == {(1.0, 0.0)}:
        return stored
    if any(not number.is_integer() for scale in scales for number in scale):
        return np.dtype(np.float32 if stored.itemsize <= 2 else np.float64)
    bits = max(bits_stored(frame) for frame in {id(f.file): f for f in frames}.values())
    signed = stored.kind == "i"
    lowest, highest = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    ends = [slope * end + intercept for slope, intercept in scales for end in (lowest, highest)]
    for candidate in (np.int16, np.int32):
        if np.iinfo(candidate).min <= min(ends) and max(ends) <= np.iinfo(candidate).max:
            return np.dtype(candidate)
    return np.dtype(np.float64)


def _fill(plane: NDArray[Any], frame: Frame) -> NDArray[np.bool_] | None:
    """Put an image's values into a slice; return where it is padding."""
    pixels = stored_pixels(frame)
    padding = padding_mask(frame, pixels)
    table = value_of(frame.file.tags, "ModalityLUTSequence")
    if table and not frame.is_rescaled:
        plane[:] = _looked_up(pixels, table[0])
    elif (frame.slope, frame.intercept) == (1.0, 0.0):
        plane[:] = pixels
    else:
        # Integers that do not fit in between come back with the next step.
        plane[:] = pixels
        if frame.slope != 1.0:
            plane *= plane.dtype.type(frame.slope)
        if frame.intercept != 0.0:
            plane += plane.dtype.type(frame.intercept)
    return padding


def _looked_up(pixels: NDArray[np.generic], table: object) -> NDArray[np.generic]:
    """Apply a modality's look-up table; beyond its ends its outermost values hold."""
    descriptor = [int(number) for number in value_of(table, "LUTDescriptor")]  # type: ignore[arg-type]
    count, first = descriptor[0] or 1 << 16, descriptor[1]
    data = value_of(table, "LUTData")  # type: ignore[arg-type]
    if isinstance(data, bytes):
        data = np.frombuffer(data, np.uint8 if len(data) == count else np.uint16)
    entries = np.asarray(data)[:count].astype(np.int32)
    if first > 1 << 15 and pixels.dtype.kind == "i":
        first -= 1 << 16
    places = np.clip(pixels.astype(np.int64) - first, 0, len(entries) - 1)
    return entries[places]


def _common_units(frames: Sequence[Frame]) -> str:
    units = {frame.units for frame in frames}
    return units.pop() if len(units) == 1 else ""


def _axes(frame: Frame) -> NDArray[np.float64]:
    """Directions of rows, columns and slices, one per row; the unit axes if unknown."""
    if not frame.orientation:
        return np.eye(3)
    return np.array([frame.orientation[:3], frame.orientation[3:], frame.normal])


def _kind_notes(first: Frame) -> tuple[str, ...]:
    if first.file.text("PhotometricInterpretation") == "MONOCHROME1":
        return (
            "The file shows its lowest value as white (MONOCHROME1); the values are as stored, "
            "not inverted.",
        )
    if first.file.text("PhotometricInterpretation") == "PALETTE COLOR":
        return ("The colours of the file's look-up table are left out; its indices are read.",)
    return ()


def _spacing(order: _Order) -> tuple[tuple[float, float, float], tuple[str, ...]]:
    spacing = order.frames[0].spacing
    if len(spacing) != 2:
        return usable_spacing(None if order.step is None else (None, None, order.step))
    return usable_spacing((spacing[1], spacing[0], order.step))


def _ordered(stack: Stack) -> _Order:
    """Sort images along their normal."""
    frames = list(stack.frames)
    if not all(frame.position for frame in frames):
        return _by_number(frames)
    along = heights(frames)
    order = np.argsort(along, kind="stable")
    ordered, places = [frames[k] for k in order], along[order]
    if len(frames) == 1:
        return _Order(ordered, frames[0].thickness)
    steps = np.diff(places)
    if not steps.min() > 1e-6:
        if steps.max() <= 1e-6:
            return _by_number(frames)
        at = int(np.argmin(steps))
        raise VolumeError(
            f"{frames[0].file.path.parent}: several slices of the series lie at one position "
            f"({ordered[at].file.path.name} and {ordered[at + 1].file.path.name}), and no field "
            "tells them apart; keep one time step or echo in the folder."
        )
    step = float(np.median(steps))
    return _Order(ordered, step, _gap_notes(places, steps, step), _shear(ordered, places))


def _by_number(frames: list[Frame]) -> _Order:
    found = [numbers_of(frame.file.tags, "SliceLocation") for frame in frames]
    if all(found) and len({place[0] for place in found}) == len(frames) > 1:
        along = np.array([place[0] for place in found])
        order = np.argsort(along, kind="stable")
        steps = np.diff(along[order])
        step = float(np.median(steps))
        said = "The slices give no position; they are ordered by their location."
        notes = (said, *_gap_notes(along[order], steps, step))
        return _Order([frames[k] for k in order], step, notes)
    ordered = sorted(frames, key=lambda frame: frame.number)
    said = "The slices give no position; they are ordered by number."
    return _Order(ordered, frames[0].thickness, (said,))


def _gap_notes(
    places: NDArray[np.float64], steps: NDArray[np.float64], step: float
) -> tuple[str, ...]:
    """Say which slices are missing, or that distances differ."""
    if steps.max() - steps.min() <= EVEN * step:
        return ()
    gaps = []
    for k, each in enumerate(steps):
        count = round(each / step) - 1
        if count >= 1 and abs(each / step - count - 1) < 0.1:
            slices = "1 slice" if count == 1 else f"{count} slices"
            ends = f"{places[k]:.5g} and {places[k + 1]:.5g} mm"
            gaps.append(f"{slices} between slices {k} and {k + 1} (at {ends})")
    if 0 < len(gaps) <= max(len(steps) * MOST_GAPS, 1):
        listed = ", ".join(gaps[:MOST_LISTED])
        listed += f" and {len(gaps) - MOST_LISTED} more gaps" if len(gaps) > MOST_LISTED else ""
        return (f"Slices may be missing: {listed}; {step:g} mm is used for all distances.",)
    return (
        f"The slices are {steps.min():g} to {steps.max():g} mm apart: some are missing, or their "
        f"distance changes; {step:g} mm is used for all, so the shape is not true everywhere.",
    )


def _shear(ordered: list[Frame], places: NDArray[np.float64]) -> tuple[float, float]:
    """Return the shift per slice along rows and columns, if it is the same everywhere."""
    axes = _axes(ordered[0])
    positions = np.array([frame.position for frame in ordered])
    sideways = (positions - positions[0]) @ axes[:2].T
    relative = (places - places[0]) / (places[-1] - places[0])
    total = sideways[-1]
    if np.abs(sideways - np.outer(relative, total)).max() > 0.1 * max(np.abs(total).max(), 1.0):
        return 0.0, 0.0
    count = len(ordered) - 1
    return float(total[0] / count), float(total[1] / count)
