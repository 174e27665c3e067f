"""NRRD files, with the header attached (.nrrd) or detached (.nhdr).

The header is parsed here and the voxels are read as a block, because VTK's NRRD
reader takes any first axis of nine or fewer voxels for components, crashes on
two-dimensional files, returns noise for truncated and ASCII ones, and is limited
to 4 GiB of compressed voxels.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.file_facts import Content, FileFacts
from model.scene.volume import Triple
from model.volume_files.anatomy import axis_labels, is_space
from model.volume_files.blocks import Block, Encoding, part_of, read_block
from model.volume_files.checks import check_grid, damaged, file_beside, truncated, unsupported
from model.volume_files.choice import LARGEST, Choice, choice_notes, chosen
from model.volume_files.frame import (
    frame_notes,
    in_one_unit,
    unit_directions,
    unit_name,
    unmirrored,
    usable_origin,
    usable_spacing,
)
from model.volume_files.grid import Grid
from model.volume_files.shear import upright

LONGEST_HEADER = 1 << 20
SPATIAL_KINDS = {"domain", "space", "none", "???"}
MOST_UNNAMED_COMPONENTS = 9

ENCODINGS: dict[str, Encoding] = {
    "raw": "raw",
    **dict.fromkeys(("gzip", "gz"), "deflate"),
    **dict.fromkeys(("bzip2", "bz2"), "bzip2"),
}
_NAMES = {
    "i1": "signed char, int8, int8_t",
    "u1": "uchar, unsigned char, uint8, uint8_t",
    "i2": "short, short int, signed short, signed short int, int16, int16_t",
    "u2": "ushort, unsigned short, unsigned short int, uint16, uint16_t",
    "i4": "int, signed int, int32, int32_t",
    "u4": "uint, unsigned int, uint32, uint32_t",
    "i8": "longlong, long long, long long int, signed long long, signed long long int, int64, "
          "int64_t",
    "u8": "ulonglong, unsigned long long, unsigned long long int, uint64, uint64_t",
    "f4": "float",
    "f8": "double",
}  # fmt: skip
SCALAR_TYPES = {name: dtype for dtype, names in _NAMES.items() for name in names.split(", ")}


@dataclass(frozen=True)
class _Header:
    """Fields of a header, by names in lower case without spaces, and its length in bytes."""

    path: Path
    fields: dict[str, str]
    length: int

    def text(self, name: str, default: str | None = None) -> str:
        value = self.fields.get(name, default)
        if value is None:
            raise damaged(self.path, f"its NRRD header has no '{name}'")
        return value

    def integers(self, name: str, default: str | None = None) -> list[int]:
        try:
            return [int(word) for word in self.text(name, default).split()]
        except ValueError:
            raise self.malformed(name) from None

    def malformed(self, name: str) -> VolumeError:
        return damaged(self.path, f"its NRRD header has a malformed '{name}'")


def read_nrrd(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a NRRD file.

    Files with four axes are read as volumes with components, or as one of several time steps.
    The fourth axis is the one whose kind is not spatial or, without kinds, the first if it
    has nine or fewer entries, and the last otherwise, which is that of time.
    """
    header = _read_header(path)
    sizes = header.integers("sizes")
    if header.integers("dimension") != [len(sizes)]:
        raise header.malformed("sizes")
    if len(sizes) > 4:
        raise unsupported(
            path, f"a NRRD of {len(sizes)} axes", "save one volume of it, with three axes or four"
        )
    component_axis = _component_axis(header, sizes)
    grid_axes = [axis for axis in range(len(sizes)) if axis != component_axis]
    dtype = _dtype(header)
    values, listed = _values(header, sizes, component_axis, dtype, choice)
    directions = _directions(header, grid_axes)
    space = _space(header)
    steps: list[float | None] | None = None
    missing = None
    length_unit = _length_unit(header, grid_axes)
    if directions is None:
        place = _place(_vectors(header.fields.get("spaceorigin", "")), header, grid_axes)
        steps, length_unit, unit_notes = _steps(header, grid_axes)
        spacing, notes = usable_spacing(steps)
        notes += unit_notes
    else:
        origin = _vectors(header.fields.get("spaceorigin", ""))
        left = space == "LAS" or header.fields.get("space", "").lower() == "3d-left-handed"
        place = _place(origin, header, grid_axes)
        straight = upright(values, directions, place, -1 if left else 1)
        values, missing, directions = straight.values, straight.missing, straight.directions
        place = straight.origin
        spacing, notes = usable_spacing(list(np.linalg.norm(directions, axis=1)))
        notes += straight.notes + frame_notes(directions)
    values, moved, mirror_notes = unmirrored(values, steps or (), place)
    if dtype.itemsize > 1 and "endian" not in header.fields:
        notes += ("The file does not say the order of bytes; little-endian is assumed.",)
    return Grid(
        values,
        spacing,
        moved,
        header.fields.get("sampleunits", "").strip('"'),
        choice_notes(listed) + mirror_notes + notes,
        axis_labels(directions, space),
        missing=missing,
        facts=FileFacts("NRRD", length_unit, unit_directions(directions), space, listed),
    )


def _values(
    header: _Header,
    sizes: list[int],
    component_axis: int | None,
    dtype: np.dtype[np.generic],
    choice: Choice,
) -> tuple[NDArray[np.generic], tuple[Content, ...]]:
    """Read the voxels, components last, and list the time steps that the file holds."""
    path = header.path
    components = 1 if component_axis is None else sizes[component_axis]
    dimensions = [size for axis, size in enumerate(sizes) if axis != component_axis]
    listed: tuple[Content, ...] = ()
    block = _block(header, sizes, dtype)
    if component_axis is not None and _is_time(header, sizes, component_axis):
        time, listed = chosen(path, "time", components, choice, dimensions, dtype)
        is_last = component_axis == len(sizes) - 1
        check_grid(path, dimensions, dtype, 1 if is_last else components)
        values = read_block(part_of(block, time) if is_last else block)
        if not is_last:
            values = np.take(values, [time], len(sizes) - 1 - component_axis)
            values = values.reshape(dimensions[::-1])
    else:
        check_grid(path, dimensions, dtype, components)
        values = read_block(block)
        if component_axis is not None:
            values = np.moveaxis(values, len(sizes) - 1 - component_axis, -1)
    return values, listed


def _place(origin: list[list[float]], header: _Header, axes: list[int]) -> Triple:
    """Return the position of the first voxel, by the space or the axes' least values."""
    if origin and len(origin[0]) == 3:
        return usable_origin(origin[0])
    return usable_origin(_axis_minima(header, axes))


def _axis_minima(header: _Header, axes: list[int]) -> list[float]:
    """Return the position of the first voxels by the axes' least values; 0 where unknown."""
    words = header.fields.get("axismins", "").split()
    numbers = [_number(words[axis]) if axis < len(words) else 0.0 for axis in axes]
    return [number if number == number else 0.0 for number in numbers]


def _steps(
    header: _Header, axes: list[int]
) -> tuple[list[float | None] | None, str, tuple[str, ...]]:
    """Return the spacing in one unit, that unit, and what is to be said of both.

    Without one the axes' least and greatest values give it: of voxels' middles, or of their edges.
    """
    found = _spacings(header, axes)
    steps: list[float | None] | None = None if found is None else [*found]
    notes: tuple[str, ...] = ()
    if found is None:
        steps = _steps_by_ends(header, axes)
        if steps is not None:
            notes = ("The voxel spacing is that of the axes' least and greatest values.",)
    if steps is None:
        return None, _length_unit(header, axes), ()
    names = re.findall(r'"([^"]*)"', header.fields.get("units", ""))
    if len(names) <= max(axes):
        return steps, _length_unit(header, axes), notes
    steps, unit, unit_notes = in_one_unit(steps, [names[axis] for axis in axes])
    return steps, unit, notes + unit_notes


def _steps_by_ends(header: _Header, axes: list[int]) -> list[float | None] | None:
    ends = [header.fields.get(name, "").split() for name in ("axismins", "axismaxs")]
    if min(map(len, ends)) <= max(axes):
        return None
    sizes, centers = header.integers("sizes"), header.fields.get("centers", "").lower().split()
    steps: list[float | None] = []
    for axis in axes:
        low, high = (_number(words[axis]) for words in ends)
        is_node = len(centers) > axis and centers[axis] == "node"
        step = (high - low) / max(sizes[axis] - 1 if is_node else sizes[axis], 1)
        steps.append(step if math.isfinite(step) and step else None)
    return steps if any(steps) else None


def _length_unit(header: _Header, axes: list[int]) -> str:
    """Return the unit of spacing and origin, if it is the same for all axes."""
    text = header.fields.get("spaceunits") or header.fields.get("units", "")
    names = re.findall(r'"([^"]*)"', text)
    if "spaceunits" not in header.fields and len(names) > max(axes):
        names = [names[axis] for axis in axes]
    return unit_name(names[0]) if names and len(set(names)) == 1 else ""


def _read_header(path: Path) -> _Header:
    with path.open("rb") as file:
        start = file.read(LONGEST_HEADER)
    if not start.startswith(b"NRRD"):
        raise VolumeError(f"{path}: this is not a NRRD file; choose another or correct its suffix.")
    end = re.search(rb"\r?\n\r?\n", start)
    text = start[: end.start() if end else None].decode("utf-8", "replace")
    fields: dict[str, str] = {}
    for line in text.splitlines()[1:]:
        name, separator, value = line.partition(": ")
        if not line.startswith("#") and separator and ":=" not in name:
            fields[name.lower().replace(" ", "")] = value.strip()
    if end is None and "datafile" not in fields:
        raise truncated(path, "its header has no end")
    return _Header(path, fields, end.end() if end else len(start))


def _dtype(header: _Header) -> np.dtype[np.generic]:
    name = header.text("type").lower()
    if name not in SCALAR_TYPES:
        raise unsupported(header.path, f"voxels of the NRRD type '{name}'", "convert them")
    order = header.text("endian", "little").lower()
    if order not in ("little", "big"):
        raise header.malformed("endian")
    return np.dtype(SCALAR_TYPES[name]).newbyteorder("<" if order == "little" else ">")


def _component_axis(header: _Header, sizes: list[int]) -> int | None:
    """Return the axis of components; None for a scalar volume."""
    kinds = header.fields.get("kinds", "").lower().split()
    if len(kinds) == len(sizes):
        named = [axis for axis, kind in enumerate(kinds) if kind not in SPATIAL_KINDS]
        if len(named) == 1:
            return named[0]
    directions = re.findall(r"none|\([^)]*\)", header.fields.get("spacedirections", ""))
    if len(directions) == len(sizes) and directions.count("none") == 1:
        return directions.index("none")
    if len(sizes) == 4:
        return 0 if sizes[0] <= MOST_UNNAMED_COMPONENTS else 3
    return None


def _is_time(header: _Header, sizes: list[int], axis: int) -> bool:
    """Whether the axis beside the three of space is that of time steps."""
    kinds = header.fields.get("kinds", "").lower().split()
    if len(kinds) == len(sizes):
        return kinds[axis] == "time"
    return axis == len(sizes) - 1


def _block(header: _Header, sizes: list[int], dtype: np.dtype[np.generic]) -> Block:
    path, offset = _data_file(header)
    encoding = header.text("encoding").lower()
    if encoding not in ENCODINGS:
        raise unsupported(header.path, f"the NRRD encoding '{encoding}'", "save it as raw or gzip")
    line_skip = header.integers("lineskip", "0")
    byte_skip = header.integers("byteskip", "0")
    if len(line_skip) != 1 or len(byte_skip) != 1 or line_skip[0] < 0 or byte_skip[0] < -1:
        raise header.malformed("line skip or byte skip")
    if encoding != "raw" and byte_skip[0] != 0:
        raise unsupported(header.path, "compressed NRRD with a byte skip", "save it without")
    if line_skip[0]:
        with path.open("rb") as file:
            file.seek(offset)
            for _ in range(line_skip[0]):
                if not file.readline():
                    raise truncated(path, "it ends within the lines to skip")
            offset = file.tell()
    offset = -1 if byte_skip[0] < 0 else offset + byte_skip[0]
    return Block(path, tuple(sizes[::-1]), dtype, offset, ENCODINGS[encoding])


def _data_file(header: _Header) -> tuple[Path, int]:
    """Return the file with the voxels, and the offset of its data before any skips."""
    name = header.fields.get("datafile")
    if name is None:
        return header.path, header.length
    if name.startswith("LIST") or re.search(r"%\d*d.* ", name):
        raise unsupported(
            header.path, "a NRRD header over several data files", "save it as one .nrrd file"
        )
    return file_beside(header.path, name), 0


def _directions(header: _Header, axes: list[int]) -> NDArray[np.float64] | None:
    text = header.fields.get("spacedirections")
    if text is None:
        return None
    vectors = _vectors(text)
    if len(vectors) != len(axes) or any(len(vector) != 3 for vector in vectors):
        raise header.malformed("space directions")
    return np.array(vectors)


def _space(header: _Header) -> str:
    """Initials of the anatomical space, such as ``"LPS"``; empty for others."""
    name = header.fields.get("space", "").upper()
    initials = "".join(word[:1] for word in name.split("-")) if "-" in name else name
    return initials if is_space(initials) else ""


def _spacings(header: _Header, axes: list[int]) -> list[float] | None:
    text = header.fields.get("spacings")
    if text is None:
        return None
    try:
        spacings = [float(word) for word in text.split()]
        return [spacings[axis] for axis in axes]
    except (ValueError, IndexError):
        raise header.malformed("spacings") from None


def _vectors(text: str) -> list[list[float]]:
    """Parse vectors such as ``(1,0,0) (0,1,0)``; invalid numbers become NaN."""
    return [
        [_number(word) for word in vector.split(",")] for vector in re.findall(r"\(([^)]*)\)", text)
    ]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")
