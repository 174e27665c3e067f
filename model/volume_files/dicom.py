"""DICOM series, given as a folder of slices or by any one of them.

The tags are parsed here, because VTK's DICOM reader wraps rescaled values into
16 bits, accepts truncated slices, and mixes the series of a folder.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.volume_files.anatomy import axis_labels
from model.volume_files.blocks import Block, read_block
from model.volume_files.checks import (
    check_grid,
    check_present,
    damaged,
    slices_in,
    truncated,
    unsupported,
)
from model.volume_files.dicom_tags import Tags, is_dicom, read_tags
from model.volume_files.frame import frame_notes, usable_origin, usable_spacing
from model.volume_files.grid import Grid

SUFFIXES = (".dcm", ".dicom", ".ima")

ROWS, COLUMNS = (0x0028, 0x0010), (0x0028, 0x0011)
BITS_ALLOCATED, BITS_STORED, SIGNED = (0x0028, 0x0100), (0x0028, 0x0101), (0x0028, 0x0103)
SAMPLES, FRAMES = (0x0028, 0x0002), (0x0028, 0x0008)
PIXEL_SPACING, SLICE_SPACING, THICKNESS = (0x0028, 0x0030), (0x0018, 0x0088), (0x0018, 0x0050)
POSITION, ORIENTATION, NUMBER = (0x0020, 0x0032), (0x0020, 0x0037), (0x0020, 0x0013)
SERIES, MODALITY, STORAGE_CLASS = (0x0020, 0x000E), (0x0008, 0x0060), (0x0002, 0x0002)
INTERCEPT, SLOPE, RESCALE_TYPE = (0x0028, 0x1052), (0x0028, 0x1053), (0x0028, 0x1054)

EVEN = 0.02
"""Relative difference below which slice distances count as equal."""


def dicom_slices(folder: Path) -> list[Path]:
    """Return the files of a folder that have a DICOM suffix or DICOM content, sorted by name.

    Raises
    ------
    VolumeError
        As for :func:`~model.volume_files.checks.slices_in`.
    """
    files = sorted(slices_in(folder, SUFFIXES))
    return [path for path in files if path.suffix.lower() in SUFFIXES or is_dicom(path)]


def read_dicom(files: list[Path], like: Path | None = None) -> Grid:
    """Read one series from DICOM files, with its slices sorted by position.

    Parameters
    ----------
    files : list of Path
        Files of one folder.
    like : Path or None
        A file of the wanted series; None for the largest series.

    Returns
    -------
    Grid
        Values rescaled by the slope and intercept of each slice.

    Raises
    ------
    VolumeError
        When a slice is foreign, damaged, truncated or compressed, or the
        slices do not form one grid.
    """
    slices, notes = _series(files, like)
    slices, step, gap_notes = _in_order(slices)
    first = slices[0]
    shape, dtype = _shape(first), _dtype(first)
    if any((_shape(tags), _dtype(tags)) != (shape, dtype) for tags in slices):
        raise VolumeError(
            f"{first.path.parent}: the slices of the series differ in size or type; "
            "keep those of one volume together."
        )
    dimensions = (shape[1], shape[0], len(slices))
    out_type = _rescaled_type(slices, dtype)
    check_grid(first.path.parent, dimensions, out_type)
    values = np.empty(dimensions[::-1], out_type)
    for plane, tags in zip(values, slices, strict=True):
        slope, intercept = _rescale(tags)
        plane[:] = _stored(tags, shape, dtype)
        if (slope, intercept) != (1, 0):
            plane *= out_type.type(slope)
            plane += out_type.type(intercept)

    row_column = first.numbers(*PIXEL_SPACING)
    spacing, spacing_notes = usable_spacing(
        [row_column[1], row_column[0], step] if len(row_column) == 2 else None
    )
    position = first.numbers(*POSITION)
    return Grid(
        values,
        spacing,
        usable_origin(position) if len(position) == 3 else (0.0, 0.0, 0.0),
        _units(first),
        notes + gap_notes + spacing_notes + frame_notes(_axes(first)),
        axis_labels(_axes(first), "LPS") if _is_placed(first) else (),
    )


def _series(files: list[Path], like: Path | None) -> tuple[list[Tags], tuple[str, ...]]:
    """Select the images of one series; also return notes for the user."""
    images: list[Tags] = []
    others: list[Tags] = []
    for path in files:
        if not is_dicom(path):
            raise VolumeError(f"{path}: this is not a DICOM file; remove it from the folder.")
        tags = read_tags(path)
        (others if tags.pixels is None else images).append(tags)
    image_classes = {tags.text(*STORAGE_CLASS) for tags in images} | {""}
    for tags in others:
        if ROWS in tags.values or tags.text(*STORAGE_CLASS) in image_classes:
            raise truncated(tags.path, "it has no pixels")
    notes: tuple[str, ...] = ()
    if others:
        notes = (f"DICOM files without an image were left out: {len(others)}.",)
    counts = Counter(tags.text(*SERIES) for tags in images)
    if not counts:
        raise VolumeError(
            f"{files[0].parent}: no DICOM file here holds an image; choose another folder."
        )
    wanted = counts.most_common(1)[0][0]
    if like is not None:
        wanted = next((tags.text(*SERIES) for tags in images if tags.path == like), wanted)
    if len(counts) > 1:
        notes += (
            f"The folder holds {len(counts)} series; the one of {counts[wanted]} slices is read.",
        )
    return [tags for tags in images if tags.text(*SERIES) == wanted], notes


def _axes(tags: Tags) -> NDArray[np.float64]:
    """Directions of rows, columns and slices, one per row; the unit axes if unknown."""
    numbers = tags.numbers(*ORIENTATION)
    if len(numbers) != 6:
        return np.eye(3)
    along_row, along_column = np.array(numbers[:3]), np.array(numbers[3:])
    return np.stack([along_row, along_column, np.cross(along_row, along_column)])


def _is_placed(tags: Tags) -> bool:
    """Return True if a slice says where in the patient it lies."""
    return len(tags.numbers(*ORIENTATION)) == 6 and len(tags.numbers(*POSITION)) == 3


def _in_order(slices: list[Tags]) -> tuple[list[Tags], float, tuple[str, ...]]:
    """Sort slices along their normal; also return their distance, and notes on gaps."""
    normal = _axes(slices[0])[2]
    positions = [tags.numbers(*POSITION) for tags in slices]
    if any(len(position) != 3 for position in positions):
        ordered = sorted(slices, key=lambda tags: (tags.numbers(*NUMBER) or [0.0])[0])
        steps_given = slices[0].numbers(*SLICE_SPACING) or slices[0].numbers(*THICKNESS) or [1.0]
        return (
            ordered,
            steps_given[0],
            ("The slices give no position; they are ordered by number.",),
        )
    heights = np.array(positions) @ normal
    order = np.argsort(heights, kind="stable")
    ordered = [slices[index] for index in order]
    if len(slices) == 1:
        return ordered, 1.0, ()
    steps = np.diff(heights[order])
    step = float(np.median(steps))
    if not steps.min() > 1e-6:
        raise VolumeError(
            f"{slices[0].path.parent}: several slices of the series lie at one position; "
            "keep one time step or echo in the folder."
        )
    if steps.max() - steps.min() > EVEN * step:
        return (
            ordered,
            step,
            (
                f"The slices are {steps.min():g} to {steps.max():g} apart, so some may be "
                f"missing; {step:g} is used for all.",
            ),
        )
    return ordered, step, ()


def _shape(tags: Tags) -> tuple[int, int]:
    return tags.short(*ROWS, default=0), tags.short(*COLUMNS, default=0)


def _dtype(tags: Tags) -> np.dtype[np.generic]:
    """Type of the stored pixels, with byte order."""
    if tags.short(*SAMPLES, default=1) != 1:
        raise unsupported(tags.path, "a DICOM file in colour", "convert it to grey values")
    if tags.text(*FRAMES) not in ("", "1"):
        raise unsupported(
            tags.path,
            "a DICOM file of several frames",
            "save it with one slice per file or as NRRD",
        )
    bits = tags.short(*BITS_ALLOCATED, default=0)
    if bits not in (8, 16, 32):
        raise unsupported(tags.path, f"a DICOM file of {bits} bits per pixel", "convert it")
    kind = "i" if tags.short(*SIGNED, default=0) else "u"
    return np.dtype(f"{tags.order}{kind}{bits // 8}")


def _stored(tags: Tags, shape: tuple[int, int], dtype: np.dtype[np.generic]) -> NDArray[np.generic]:
    """Stored pixels of one slice, sign-extended or cleared in their unused high bits."""
    assert tags.pixels is not None
    offset, length = tags.pixels
    block = Block(tags.path, shape, dtype, offset)
    check_present(tags.path, length, block.nbytes)
    pixels = read_block(block)
    unused = dtype.itemsize * 8 - _bits_stored(tags, dtype)
    return (pixels << unused) >> unused if unused else pixels  # type: ignore[operator]


def _bits_stored(tags: Tags, dtype: np.dtype[np.generic]) -> int:
    """Number of low bits that hold the value."""
    allocated = dtype.itemsize * 8
    stored = tags.short(*BITS_STORED, default=allocated)
    if not 1 <= stored <= allocated:
        raise damaged(tags.path, "its bits stored exceed its bits allocated")
    return stored


def _rescale(tags: Tags) -> tuple[float, float]:
    slope, intercept = tags.numbers(*SLOPE) or [1.0], tags.numbers(*INTERCEPT) or [0.0]
    if slope[0] == 0 or not np.isfinite([slope[0], intercept[0]]).all():
        return 1.0, 0.0
    return slope[0], intercept[0]


def _rescaled_type(slices: list[Tags], dtype: np.dtype[np.generic]) -> np.dtype[np.generic]:
    """Type for all slices' rescaled pixels: an integer type if the values are integers and fit."""
    scales = {_rescale(tags) for tags in slices}
    native = dtype.newbyteorder("=")
    if scales == {(1.0, 0.0)}:
        return native
    if any(not number.is_integer() for scale in scales for number in scale):
        return np.dtype(np.float32)
    bits = max(_bits_stored(tags, dtype) for tags in slices)
    signed = dtype.kind == "i"
    lowest, highest = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
    ends = [slope * end + intercept for slope, intercept in scales for end in (lowest, highest)]
    for candidate in (np.int16, np.int32):
        if np.iinfo(candidate).min <= min(ends) and max(ends) <= np.iinfo(candidate).max:
            return np.dtype(candidate)
    return np.dtype(np.float64)


def _units(tags: Tags) -> str:
    kind = tags.text(*RESCALE_TYPE)
    if kind in ("", "US"):
        return "HU" if tags.text(*MODALITY) == "CT" else ""
    return kind
