"""MetaImage files, with the voxels attached (.mha) or in a separate file (.mhd).

The header is parsed here and the voxels are read as a block, because VTK's MetaImage
reader crashes on 64-bit integers and on four axes, and prints to the terminal.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.file_facts import Content, FileFacts
from model.volume_files.anatomy import OPPOSITES, axis_labels, is_space
from model.volume_files.blocks import Block, part_of, read_block
from model.volume_files.checks import check_grid, damaged, file_beside, truncated, unsupported
from model.volume_files.choice import LARGEST, Choice, choice_notes, chosen
from model.volume_files.frame import (
    frame_notes,
    unit_directions,
    unit_name,
    unmirrored,
    usable_spacing,
)
from model.volume_files.grid import Grid
from model.volume_files.shear import upright

LONGEST_HEADER = 1 << 16

SCALAR_TYPES = {
    "MET_CHAR": "i1", "MET_UCHAR": "u1", "MET_SHORT": "i2", "MET_USHORT": "u2", "MET_INT": "i4",
    "MET_UINT": "u4", "MET_LONG": "i4", "MET_ULONG": "u4", "MET_LONG_LONG": "i8",
    "MET_ULONG_LONG": "u8", "MET_FLOAT": "f4", "MET_DOUBLE": "f8",
}  # fmt: skip


@dataclass(frozen=True)
class _Header:
    """Fields of a header by name, and its length in bytes."""

    path: Path
    fields: dict[str, str]
    length: int

    def first(self, *names: str) -> str | None:
        """Return the value of the first of these fields that exists, or None."""
        return next((self.fields[name] for name in names if name in self.fields), None)

    def numbers(self, count: int, *names: str) -> list[float] | None:
        text = self.first(*names)
        if text is None:
            return None
        try:
            numbers = [float(word) for word in text.split()]
        except ValueError:
            numbers = []
        if len(numbers) != count:
            raise self.malformed(names[0])
        return numbers

    def integers(self, *names: str, default: str | None = None) -> list[int]:
        try:
            return [int(word) for word in (self.first(*names) or default or "").split()]
        except ValueError:
            raise self.malformed(names[0]) from None

    def is_true(self, *names: str, default: str) -> bool:
        return (self.first(*names) or default).lower() in ("true", "1", "t")

    def malformed(self, name: str) -> VolumeError:
        return damaged(self.path, f"its MetaImage header has a missing or malformed '{name}'")


def read_metaimage(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a MetaImage file; a fourth axis is that of time steps, of which one is read."""
    header = _read_header(path)
    sizes = header.integers("DimSize")
    if header.integers("NDims") != [len(sizes)]:
        raise header.malformed("DimSize")
    channels = header.integers("ElementNumberOfChannels", default="1")
    if len(channels) != 1:
        raise header.malformed("ElementNumberOfChannels")
    dtype = _dtype(header)
    if len(sizes) > 4:
        raise unsupported(
            path,
            f"a MetaImage of {len(sizes)} dimensions",
            "save one volume of it, with three dimensions or four",
        )
    values, listed = _values(header, sizes, channels[0], dtype, choice)
    axes = len(sizes)
    steps = (header.numbers(axes, "ElementSpacing", "ElementSize") or [])[:3] or None
    spacing, notes = usable_spacing(steps)
    matrix = header.numbers(axes * axes, "TransformMatrix", "Rotation", "Orientation")
    directions = None
    if matrix is not None:
        directions = np.array(matrix).reshape(axes, axes)[:3, :3]
    origin = (header.numbers(axes, "Offset", "Position", "Origin") or [])[:3]
    unit = unit_directions(directions)
    values, place, mirror_notes = unmirrored(
        values, steps or (), origin or (0.0, 0.0, 0.0), np.array(unit) if unit else None
    )
    missing = None
    if unit:
        straight = upright(values, np.array(unit) * np.array(spacing)[:, None], place)
        values, missing, place = straight.values, straight.missing, straight.origin
        directions, unit = straight.directions, unit_directions(straight.directions)
        spacing, _ = usable_spacing(np.linalg.norm(directions, axis=1).tolist())
        notes += straight.notes + frame_notes(directions)
    labels = _labels(header, directions)
    return Grid(
        values,
        spacing,
        place,
        notes=choice_notes(listed) + mirror_notes + notes,
        axis_labels=labels,
        missing=missing,
        facts=FileFacts(
            "MetaImage",
            unit_name(header.first("DistanceUnits") or ""),
            unit,
            "LPS" if labels and unit else "",
            listed,
        ),
    )


def _values(
    header: _Header, sizes: list[int], channels: int, dtype: np.dtype[np.generic], choice: Choice
) -> tuple[NDArray[np.generic], tuple[Content, ...]]:
    """Read the voxels, channels last, and list the time steps that the file holds."""
    path = header.path
    check_grid(path, sizes[:3] if len(sizes) == 4 else sizes, dtype, channels)
    shape = tuple(sizes[::-1]) + ((channels,) if channels > 1 else ())
    block = _block(header, shape, dtype)
    listed: tuple[Content, ...] = ()
    if len(sizes) == 4:
        time, listed = chosen(path, "time", sizes[3], choice, sizes[:3], dtype)
        block = part_of(block, time)
    values = read_block(block)
    return values, listed


def _labels(header: _Header, directions: NDArray[np.float64] | None) -> tuple[str, ...]:
    """Directions of the axes in the patient; empty for a file that names none."""
    anatomical = (header.first("AnatomicalOrientation") or "").upper()
    if not is_space(anatomical):
        return ()
    if directions is None:
        # The letters say where each axis comes from.
        toward = "".join(OPPOSITES[letter] for letter in anatomical)
        return axis_labels(np.eye(3), toward)
    # As ITK, which writes both: the matrix holds, and its space is the patient's.
    return axis_labels(directions, "LPS")


def _read_header(path: Path) -> _Header:
    fields: dict[str, str] = {}
    with path.open("rb") as file:
        while "ElementDataFile" not in fields and file.tell() < LONGEST_HEADER:
            line = file.readline(LONGEST_HEADER)
            name, separator, value = line.decode("utf-8", "replace").partition("=")
            if line and not line.strip():
                continue
            if not separator:
                break
            fields[name.strip()] = value.strip()
        if "NDims" not in fields and "ObjectType" not in fields:
            raise VolumeError(
                f"{path}: this is not a MetaImage file; choose another or correct its suffix."
            )
        if not fields.get("ElementDataFile"):
            raise truncated(path, "its header has no end")
        return _Header(path, fields, file.tell())


def _dtype(header: _Header) -> np.dtype[np.generic]:
    name = header.first("ElementType")
    if name is None:
        raise header.malformed("ElementType")
    name = name.removesuffix("_ARRAY")
    if name not in SCALAR_TYPES:
        raise unsupported(header.path, f"voxels of the MetaImage type '{name}'", "convert them")
    big = header.is_true("BinaryDataByteOrderMSB", "ElementByteOrderMSB", default="False")
    return np.dtype(SCALAR_TYPES[name]).newbyteorder(">" if big else "<")


def _block(header: _Header, shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> Block:
    path, offset = _data_file(header)
    if not header.is_true("BinaryData", default="True"):
        raise unsupported(header.path, "MetaImage with ASCII voxels", "save it as binary")
    skip = header.integers("HeaderSize", default="0")
    if len(skip) != 1 or skip[0] < -1:
        raise header.malformed("HeaderSize")
    compressed = header.is_true("CompressedData", default="False")
    if skip[0] < 0 and not compressed:
        offset = -1
    elif skip[0] > 0:
        offset = skip[0]
    return Block(path, shape, dtype, offset, "deflate" if compressed else "raw")


def _data_file(header: _Header) -> tuple[Path, int]:
    """Return the file with the voxels, and the offset of its data."""
    name = header.fields["ElementDataFile"]
    if name.upper() == "LOCAL":
        return header.path, header.length
    if name.startswith("LIST") or "%" in name:
        raise unsupported(
            header.path, "a MetaImage header over several data files", "save it as one .mha file"
        )
    return file_beside(header.path, name), 0
