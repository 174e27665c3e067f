"""NRRD and MetaImage: headers of "key: value" lines; voxels follow or are in another file.

VTK's readers crash on 64-bit integers and on four axes, and return noise for truncated files.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.slices import OPPOSITES
from model.scene.volume import Content, FileFacts, Label
from model.volume_files.blocks import Block, Encoding, part_of, read_block
from model.volume_files.checks import (
    check_grid,
    damaged,
    file_beside,
    not_a,
    truncated,
    unsupported,
)
from model.volume_files.choice import LARGEST, Choice, chosen
from model.volume_files.grid import Grid, axis_labels, in_one_unit, is_space, placed, unit_name
from model.volume_files.label_names import slicer_segments

LONGEST_HEAD = 1 << 20
MOST_UNNAMED_COMPONENTS = 9

_ENCODINGS: dict[str, Encoding] = {
    "raw": "raw",
    **dict.fromkeys(("gzip", "gz"), "deflate"),
    **dict.fromkeys(("bzip2", "bz2"), "bzip2"),
}
_NAMES = {
    "i1": "signed char, int8, int8_t, MET_CHAR",
    "u1": "uchar, unsigned char, uint8, uint8_t, MET_UCHAR",
    "i2": "short, short int, signed short, signed short int, int16, int16_t, MET_SHORT",
    "u2": "ushort, unsigned short, unsigned short int, uint16, uint16_t, MET_USHORT",
    "i4": "int, signed int, int32, int32_t, MET_INT, MET_LONG",
    "u4": "uint, unsigned int, uint32, uint32_t, MET_UINT, MET_ULONG",
    "i8": "longlong, long long, long long int, signed long long, signed long long int, int64, "
          "int64_t, MET_LONG_LONG",
    "u8": "ulonglong, unsigned long long, unsigned long long int, uint64, uint64_t, "
          "MET_ULONG_LONG",
    "f4": "float, MET_FLOAT",
    "f8": "double, MET_DOUBLE",
}  # fmt: skip
_TYPES = {name.lower(): dtype for dtype, names in _NAMES.items() for name in names.split(", ")}
_SPATIAL_KINDS = {"domain", "space", "none", "???"}

_ALIASES = {
    "ElementSpacing": ("ElementSize",),
    "TransformMatrix": ("Rotation", "Orientation"),
    "Offset": ("Position", "Origin"),
    "BinaryDataByteOrderMSB": ("ElementByteOrderMSB",),
}
"""Other names of MetaImage's fields."""


@dataclass(frozen=True)
class _Head:
    """Fields of a header by name, and its length in bytes."""

    path: Path
    form: str
    fields: dict[str, str]
    length: int
    labels: tuple[Label, ...] = ()

    def text(self, name: str, default: str | None = None) -> str:
        value = self.fields.get(name, default)
        if value is None:
            raise self.malformed(name)
        return value

    def integers(self, name: str, default: str | None = None) -> list[int]:
        try:
            return [int(word) for word in self.text(name, default).split()]
        except ValueError:
            raise self.malformed(name) from None

    def sizes(self, name: str, count: str) -> list[int]:
        sizes = self.integers(name)
        if self.integers(count) != [len(sizes)]:
            raise self.malformed(name)
        if len(sizes) > 4:
            what = f"a {self.form} of {len(sizes)} axes"
            raise unsupported(self.path, what, "save one volume of it, with three axes or four")
        return sizes

    def numbers(self, name: str, count: int) -> list[float] | None:
        if name not in self.fields:
            return None
        try:
            numbers = [float(word) for word in self.fields[name].split()]
        except ValueError:
            numbers = []
        if len(numbers) < count or (len(numbers) > count and self.form == "MetaImage"):
            raise self.malformed(name)
        return numbers

    def is_true(self, name: str, default: str = "False") -> bool:
        return self.text(name, default).lower() in ("true", "1", "t")

    def malformed(self, name: str) -> VolumeError:
        how = "a malformed" if name.replace(" ", "") in self.fields else "no"
        return damaged(self.path, f"its {self.form} header has {how} '{name}'")

    def dtype(self, name: str, is_big: bool) -> np.dtype[np.generic]:
        kind = _TYPES.get(name.lower().removesuffix("_array"))
        if kind is None:
            raise unsupported(self.path, f"voxels of the {self.form} type '{name}'", "convert them")
        return np.dtype(kind).newbyteorder(">" if is_big else "<")

    def data_file(self, name: str | None) -> tuple[Path, int]:
        """Return the file with the voxels, and their offset before any skips."""
        if name is None:
            return self.path, self.length
        if name.startswith("LIST") or re.search(r"%\d*d.* ", name):
            raise unsupported(
                self.path, f"a {self.form} header over several data files", "save it as one file"
            )
        return file_beside(self.path, name), 0


# --- NRRD ---------------------------------------------------------------------------------


def read_nrrd(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a NRRD file; one of four axes has components or time steps.

    It is the axis whose kind is not spatial. Without kinds it is the first, with components, if it
    has at most nine entries, else the last, with time steps.
    """
    head = _nrrd_head(path)
    sizes = head.sizes("sizes", "dimension")
    order = head.text("endian", "little").lower()
    if order not in ("little", "big"):
        raise head.malformed("endian")
    dtype = head.dtype(head.text("type"), order == "big")
    rows = _vectors(head.fields.get("spacedirections", ""))
    extra = _extra_axis(head, sizes, rows)
    axes = [axis for axis in range(len(sizes)) if axis != extra]
    values, listed = _nrrd_values(head, sizes, extra, dtype, choice)
    space = _space(head)
    notes: tuple[str, ...] = ()
    directions = None
    origin = (_vectors(head.fields.get("spaceorigin", "")) or [[]])[0][:3]
    if "spacedirections" in head.fields:
        vectors = [rows[axis] for axis in axes] if len(rows) == len(sizes) else rows
        if len(vectors) != 3 or any(len(vector) not in (3, 4) for vector in vectors):
            raise head.malformed("space directions")
        directions = np.array([vector[:3] for vector in vectors])
        steps: list[float | None] | None = [*np.linalg.norm(directions, axis=1).tolist()]
        unit = _length_unit(head, axes)
    else:
        steps, unit, notes = _steps(head, axes)
    if len(origin) != 3:
        words = head.fields.get("axismins", "").split()
        origin = [_number(words[axis]) if axis < len(words) else 0.0 for axis in axes]
    is_left = space == "LAS" or head.fields.get("space", "").lower() == "3d-left-handed"
    if dtype.itemsize > 1 and "endian" not in head.fields:
        notes += ("The file does not say the order of bytes; little-endian is assumed.",)
    grid = Grid(
        values,
        origin=origin,
        units=head.fields.get("sampleunits", "").strip('"'),
        notes=notes,
        facts=FileFacts(
            "NRRD",
            unit,
            space=space,
            contents=listed,
            is_labels=bool(head.labels),
            labels=head.labels,
        ),
    )
    return placed(grid, steps, directions, space, is_left_handed=is_left)


def _nrrd_head(path: Path) -> _Head:
    with path.open("rb") as file:
        start = file.read(LONGEST_HEAD)
    if not start.startswith(b"NRRD"):
        raise not_a(path, "a NRRD file")
    end = re.search(rb"\r?\n\r?\n", start)
    text = start[: end.start() if end else None].decode("utf-8", "replace")
    fields: dict[str, str] = {}
    pairs: dict[str, str] = {}
    for line in text.splitlines()[1:]:
        name, separator, value = line.partition(": ")
        key, assigned, pair = line.partition(":=")
        if assigned:
            pairs[key] = pair
        elif not line.startswith("#") and separator:
            fields[name.lower().replace(" ", "")] = value.strip()
    if end is None and "datafile" not in fields:
        raise truncated(path, "its header has no end")
    length = end.end() if end else len(start)
    return _Head(path, "NRRD", fields, length, slicer_segments(pairs))


def _extra_axis(head: _Head, sizes: list[int], rows: list[list[float]]) -> int | None:
    """Return the axis that is not spatial; None for a scalar volume."""
    kinds = head.fields.get("kinds", "").lower().split()
    if len(kinds) == len(sizes):
        named = [axis for axis, kind in enumerate(kinds) if kind not in _SPATIAL_KINDS]
        if len(named) == 1:
            return named[0]
    if len(rows) == len(sizes) == 4:
        # Rows of "none" or NaN, or along the time of a space that has one.
        apart = [k for k, row in enumerate(rows) if not row or all(math.isnan(n) for n in row)]
        apart = apart or [k for k, row in enumerate(rows) if len(row) == 4 and not any(row[:3])]
        if len(apart) == 1:
            return apart[0]
    if len(sizes) == 4:
        return 0 if sizes[0] <= MOST_UNNAMED_COMPONENTS else 3
    return None


def _nrrd_values(
    head: _Head, sizes: list[int], extra: int | None, dtype: np.dtype[np.generic], choice: Choice
) -> tuple[NDArray[np.generic], tuple[Content, ...]]:
    """Read the voxels, components last, and list the file's time steps."""
    path, last = head.path, len(sizes) - 1
    count = 1 if extra is None else sizes[extra]
    dimensions = [size for axis, size in enumerate(sizes) if axis != extra]
    block = _nrrd_block(head, sizes, dtype)
    kinds = head.fields.get("kinds", "").lower().split()
    is_time = (
        extra == last
        if len(kinds) != len(sizes)
        else extra is not None and (kinds[extra] == "time")
    )
    if extra is None or not is_time:
        check_grid(path, dimensions, dtype, count)
        values = read_block(block)
        return values if extra is None else np.moveaxis(values, last - extra, -1), ()
    time, listed = chosen(path, "time", count, choice, dimensions, dtype)
    check_grid(path, dimensions, dtype, 1 if extra == last else count)
    if extra == last:
        return read_block(part_of(block, time)), listed
    values = np.take(read_block(block), [time], last - extra)
    return values.reshape(dimensions[::-1]), listed


def _nrrd_block(head: _Head, sizes: list[int], dtype: np.dtype[np.generic]) -> Block:
    path, offset = head.data_file(head.fields.get("datafile"))
    encoding = head.text("encoding").lower()
    if encoding not in _ENCODINGS:
        raise unsupported(head.path, f"the NRRD encoding '{encoding}'", "save it as raw or gzip")
    lines, skip = head.integers("lineskip", "0"), head.integers("byteskip", "0")
    if len(lines) != 1 or len(skip) != 1 or lines[0] < 0 or skip[0] < -1:
        raise damaged(head.path, "its NRRD header has a malformed 'line skip or byte skip'")
    if encoding != "raw" and skip[0] != 0:
        raise unsupported(head.path, "compressed NRRD with a byte skip", "save it without")
    if lines[0]:
        with path.open("rb") as file:
            file.seek(offset)
            for _ in range(lines[0]):
                if not file.readline():
                    raise truncated(path, "it ends within the lines to skip")
            offset = file.tell()
    offset = -1 if skip[0] < 0 else offset + skip[0]
    return Block(path, tuple(sizes[::-1]), dtype, offset, _ENCODINGS[encoding])


def _steps(head: _Head, axes: list[int]) -> tuple[list[float | None] | None, str, tuple[str, ...]]:
    """Return the spacing in one unit, that unit, and notes."""
    found = head.numbers("spacings", max(axes) + 1)
    steps: list[float | None] | None = None if found is None else [found[axis] for axis in axes]
    notes: tuple[str, ...] = ()
    ends = [head.fields.get(name, "").split() for name in ("axismins", "axismaxs")]
    if steps is None and min(map(len, ends)) > max(axes):
        sizes, centers = head.integers("sizes"), head.fields.get("centers", "").lower().split()
        steps = []
        for axis in axes:
            low, high = (_number(words[axis]) for words in ends)
            is_node = len(centers) > axis and centers[axis] == "node"
            step = (high - low) / max(sizes[axis] - 1 if is_node else sizes[axis], 1)
            steps.append(step if math.isfinite(step) and step else None)
        steps = steps if any(steps) else None
        if steps:
            notes = ("The voxel spacing is that of the axes' least and greatest values.",)
    names = re.findall(r'"([^"]*)"', head.fields.get("units", ""))
    if steps is None or len(names) <= max(axes):
        return steps, _length_unit(head, axes), notes
    steps, unit, unit_notes = in_one_unit(steps, [names[axis] for axis in axes])
    return steps, unit, notes + unit_notes


def _length_unit(head: _Head, axes: list[int]) -> str:
    """Return the unit of spacing and origin, if it is the same for all axes."""
    text = head.fields.get("spaceunits") or head.fields.get("units", "")
    names = re.findall(r'"([^"]*)"', text)
    if "spaceunits" not in head.fields and len(names) > max(axes):
        names = [names[axis] for axis in axes]
    names = names[:3]
    return unit_name(names[0]) if names and len(set(names)) == 1 else ""


def _space(head: _Head) -> str:
    """Initials of the anatomical space, such as ``"LPS"``; empty for others."""
    name = head.fields.get("space", "").upper().removesuffix("-TIME")
    initials = "".join(word[:1] for word in name.split("-")) if "-" in name else name
    initials = initials[:3] if len(initials) == 4 and initials.endswith("T") else initials
    return initials if is_space(initials) else ""


def _vectors(text: str) -> list[list[float]]:
    """Parse vectors such as ``(1,0,0) none``; invalid numbers become NaN, none an empty one."""
    return [
        [_number(word) for word in inside.split(",")] if word != "none" else []
        for word, inside in re.findall(r"(none|\(([^)]*)\))", text)
    ]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


# --- MetaImage ----------------------------------------------------------------------------


def read_metaimage(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a MetaImage file, or one time step of it if it has a fourth axis."""
    head = _metaimage_head(path)
    sizes = head.sizes("DimSize", "NDims")
    channels = head.integers("ElementNumberOfChannels", "1")
    if len(channels) != 1:
        raise head.malformed("ElementNumberOfChannels")
    axes = len(sizes)
    dtype = head.dtype(head.text("ElementType"), head.is_true("BinaryDataByteOrderMSB"))
    check_grid(path, sizes[:3] if axes == 4 else sizes, dtype, channels[0])
    shape = (*sizes[::-1], *(channels if channels[0] > 1 else ()))
    block = _metaimage_block(head, shape, dtype)
    listed: tuple[Content, ...] = ()
    if axes == 4:
        time, listed = chosen(path, "time", sizes[3], choice, sizes[:3], dtype)
        block = part_of(block, time)
    steps = (head.numbers("ElementSpacing", axes) or [])[:3] or None
    matrix = head.numbers("TransformMatrix", axes * axes)
    rows = None if matrix is None else np.array(matrix).reshape(axes, axes)[:3, :3]
    origin = (head.numbers("Offset", axes) or [0.0, 0.0, 0.0])[:3]
    letters = head.fields.get("AnatomicalOrientation", "").upper()
    labels: tuple[str, ...] = ()
    if is_space(letters) and rows is None:
        # They name where each axis comes from. A matrix takes precedence, as in ITK, which writes
        # both, and its space is the patient's.
        labels = axis_labels(np.eye(3), "".join(OPPOSITES[letter] for letter in letters))
    grid = Grid(
        read_block(block),
        origin=origin,
        axis_labels=labels,
        facts=FileFacts(
            "MetaImage", unit_name(head.fields.get("DistanceUnits", "")), contents=listed
        ),
    )
    return placed(grid, steps, rows, "LPS" if is_space(letters) else "")


def _metaimage_head(path: Path) -> _Head:
    fields: dict[str, str] = {}
    with path.open("rb") as file:
        while "ElementDataFile" not in fields and file.tell() < LONGEST_HEAD:
            line = file.readline(LONGEST_HEAD)
            name, separator, value = line.decode("utf-8", "replace").partition("=")
            if line and (not line.strip() or line.startswith(b"#")):
                continue
            if not separator:
                break
            fields[name.strip()] = value.strip()
        length = file.tell()
    if "NDims" not in fields and "ObjectType" not in fields:
        raise not_a(path, "a MetaImage file")
    if not fields.get("ElementDataFile"):
        raise truncated(path, "its header has no end")
    for name, others in _ALIASES.items():
        found = next((fields[other] for other in others if other in fields), None)
        if found is not None:
            fields.setdefault(name, found)
    return _Head(path, "MetaImage", fields, length)


def _metaimage_block(head: _Head, shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> Block:
    name = head.fields["ElementDataFile"]
    path, offset = head.data_file(None if name.upper() == "LOCAL" else name)
    if not head.is_true("BinaryData", "True"):
        raise unsupported(head.path, "MetaImage with ASCII voxels", "save it as binary")
    skip = head.integers("HeaderSize", "0")
    if len(skip) != 1 or skip[0] < -1:
        raise head.malformed("HeaderSize")
    is_compressed = head.is_true("CompressedData")
    if skip[0] < 0 and not is_compressed:
        offset = -1
    elif skip[0] > 0:
        offset = skip[0]
    return Block(path, shape, dtype, offset, "deflate" if is_compressed else "raw")
