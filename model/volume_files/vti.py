"""VTK image data in XML (.vti), read by VTK."""

from __future__ import annotations

import base64
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from model.errors import VolumeError
from model.volume_files.checks import (
    check_grid,
    check_present,
    damaged,
    not_a,
    times,
    truncated,
    unsupported,
)
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.grid import Grid, usable_spacing
from model.volume_files.vtk_images import VtkArray, chosen_array, image_grid, run_quietly

LONGEST_HEADER = 1 << 20
TAIL = 1 << 12
GREATEST_RATIOS = {
    "vtkZLibDataCompressor": 1032,
    "vtkLZ4DataCompressor": 255,
    "vtkLZMADataCompressor": 1 << 14,
}
"""Largest compression ratios."""


def read_vti(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read an array of VTK image data in XML: ASCII, base64 or raw, compressed or not."""
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    with path.open("rb") as file:
        header = _read_header(path, file)
        _check_arrays(path, header)
        _check_extent(path, header)
        if header.compressor:
            for start in _compressed_arrays(path, header):
                _check_blocks(path, file, header, *start)
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    run_quietly(path, reader.UpdateInformation)
    chosen, arrays = chosen_array(path, _arrays(reader, header), choice)
    for selection, in_cells in (
        (reader.GetPointDataArraySelection(), False),
        (reader.GetCellDataArraySelection(), True),
    ):
        for number in range(selection.GetNumberOfArrays()):
            name = selection.GetArrayName(number)
            wanted = VtkArray(name, in_cells, None).is_ghost or name == chosen.name
            if not wanted or in_cells != chosen.in_cells:
                selection.DisableArray(name)
    run_quietly(path, reader.Update)
    own = _own_extent(path, header)
    grid = image_grid(path, reader.GetOutput(), chosen, arrays, "VTI", own)
    if not header.attribute("Spacing"):
        grid = replace(grid, notes=(*grid.notes, *usable_spacing(None)[1]))
    if own is None:
        return grid
    whole = times(reader.GetOutput().GetDimensions())
    note = f"The file has a piece of a whole of {whole} points; the piece is read."
    return replace(grid, notes=(*grid.notes, note))


def _arrays(reader: Any, header: _Header) -> list[VtkArray]:
    """List the arrays that VTK finds, with what their elements say of them."""
    found = []
    for selection, in_cells, part in (
        (reader.GetPointDataArraySelection(), False, header.part("PointData")),
        (reader.GetCellDataArraySelection(), True, header.part("CellData")),
    ):
        active = header.attribute("Scalars", part.partition(">")[0])
        elements = {
            header.attribute("Name", element): element
            for element in reversed(re.findall(r"<DataArray\b[^>]*>", part))
        }
        texts = {
            header.attribute("Name", element)
            for element in re.findall(r"""<Array\b[^>]*type\s*=\s*["']String["'][^>]*>""", part)
        }
        for number in range(selection.GetNumberOfArrays()):
            name = selection.GetArrayName(number) or ""
            if name in texts:
                continue
            element = elements.get(name, "") if isinstance(name, str) else ""
            dtype, components = header.type_of(element)
            found.append(VtkArray(name, in_cells, dtype, components, bool(name) and name == active))
    return found


def _integers(text: str) -> list[int]:
    return [int(number) for number in re.findall(r"-?\d{1,18}", text)]


def _own_extent(path: Path, header: _Header) -> list[int] | None:
    """Return the extent of the pieces that the file has, if that is less than the whole."""
    extents = re.findall(r"""<Piece\b[^>]*\bExtent\s*=\s*["']([^"']*)["']""", header.text)
    *pieces, whole = map(_integers, (*extents, header.attribute("WholeExtent")))
    if not pieces or any(len(piece) != 6 for piece in pieces):
        return None
    own = [(min if k % 2 == 0 else max)(piece[k] for piece in pieces) for k in range(6)]
    if own == whole:
        return None
    if any(own[k] < whole[k] or own[k + 1] > whole[k + 1] for k in (0, 2, 4)):
        raise damaged(path, "a piece lies outside the whole extent")
    return own


@dataclass(frozen=True)
class _Header:
    """The XML before the voxels, decoded as latin-1 so that characters are bytes."""

    text: str
    file_size: int

    def attribute(self, name: str, element: str | None = None) -> str:
        """Return an attribute's first value, in an element or anywhere; empty if missing."""
        found = re.search(rf"""\b{name}\s*=\s*["']([^"']*)["']""", element or self.text)
        return found.group(1) if found else ""

    @property
    def compressor(self) -> str:
        return self.attribute("compressor")

    @property
    def capacity(self) -> int:
        """Largest number of uncompressed bytes that a file of this size can hold."""
        return self.file_size * GREATEST_RATIOS.get(self.compressor, 1)

    @property
    def arrays(self) -> list[re.Match[str]]:
        """Elements that describe arrays."""
        return list(re.finditer(r"<DataArray\b[^>]*>", self.text))

    def part(self, name: str) -> str:
        """Return the first element of a name; empty if there is none."""
        found = re.search(
            rf"<{name}\b[^>]*[^/]>.*?</{name}>|<{name}>.*?</{name}>", self.text, re.DOTALL
        )
        return found.group() if found else ""

    def type_of(self, element: str) -> tuple[np.dtype[np.generic] | None, int]:
        """Return type and number of the components that an array's element gives."""
        kind = re.fullmatch(r"(U?Int|Float)(8|16|32|64)", self.attribute("type", element))
        components = self.attribute("NumberOfComponents", element)
        count = int(components) if re.fullmatch(r"[1-9]\d{0,3}", components) else 1
        return np.dtype(kind.group().lower()) if kind else None, count

    @property
    def word(self) -> np.dtype[np.generic]:
        """Type of the numbers in the header of each array."""
        order = ">" if self.attribute("byte_order") == "BigEndian" else "<"
        return np.dtype(order + ("u8" if self.attribute("header_type") == "UInt64" else "u4"))


def _read_header(path: Path, file: BinaryIO) -> _Header:
    start = file.read(LONGEST_HEADER)
    size = path.stat().st_size
    file.seek(max(size - TAIL, 0))
    tail = file.read()
    if b"<VTKFile" not in start or b"ImageData" not in start:
        raise not_a(path, "VTK image data in XML")
    # VTK does not detect truncated raw appended data.
    if b"</VTKFile>" not in tail:
        raise truncated(path, "its closing tag is missing")
    return _Header(start.decode("latin-1"), size)


def _check_arrays(path: Path, header: _Header) -> None:
    """Refuse a file without arrays, or with one of bits, which VTK packs."""
    if not header.arrays:
        raise VolumeError(f"{path}: it holds no values, only a grid; choose another.")
    if any(header.attribute("type", array.group()) == "Bit" for array in header.arrays):
        raise unsupported(
            path, "an array of bits", "convert it to unsigned char, as with ParaView's Calculator"
        )


def _check_extent(path: Path, header: _Header) -> None:
    """Check the extent against the machine's memory and the file's size."""
    ends = _integers(header.attribute("WholeExtent"))
    if len(ends) != 6:
        raise damaged(path, "its header has no extent of six numbers")
    dimensions = [last - first + 1 for first, last in zip(ends[::2], ends[1::2], strict=True)]
    types = [header.type_of(array.group()) for array in header.arrays]
    each = sum(dtype.itemsize * count for dtype, count in types if dtype is not None)
    check_grid(path, dimensions, np.dtype((np.void, max(each, 1))))
    check_present(path, header.capacity, math.prod(dimensions))


def _compressed_arrays(path: Path, header: _Header) -> list[tuple[int, bool]]:
    """Return the first byte of each compressed array, and True if it is in base64."""
    # VTK takes the first one of its raw text, even within a comment.
    first = header.text.find("<AppendedData")
    appended = re.compile(r"<AppendedData\b[^>]*>\s*_").match(header.text, max(first, 0))
    if first >= 0 and appended is None:
        raise damaged(path, "its appended data does not begin with an underscore")
    starts = []
    for array in header.arrays:
        offset = header.attribute("offset", array.group())
        form = header.attribute("format", array.group())
        if form == "appended" and appended and re.fullmatch(r"\d{1,18}", offset):
            encoded = header.attribute("encoding", appended.group()) != "raw"
            starts.append((appended.end() + int(offset), encoded))
        elif form == "binary":
            text = header.text[array.end() :]
            starts.append((array.end() + len(text) - len(text.lstrip()), True))
        elif form != "ascii":
            raise damaged(path, "an array does not say where its values are")
    return starts


def _check_blocks(path: Path, file: BinaryIO, header: _Header, start: int, encoded: bool) -> None:
    """Check the header of a compressed array; VTK aborts or hangs on invalid ones."""

    def numbers(count: int) -> list[int]:
        size = count * header.word.itemsize
        file.seek(start)
        # Base64 writes three bytes as four characters.
        data = base64.b64decode(file.read(-(-size // 3) * 4)) if encoded else file.read(size)
        return [int(number) for number in np.frombuffer(data[:size], header.word)]

    try:
        blocks, block, last = numbers(3)
        if blocks * header.word.itemsize > header.file_size:
            raise damaged(path, f"an array claims {blocks} compressed blocks")
        compressed = sum(numbers(3 + blocks)[3:])
    except ValueError:
        raise damaged(path, "a compressed array has no head") from None
    unpacked = (blocks - 1) * block + (last or block)
    if blocks and (block == 0 or last > block or unpacked > header.capacity):
        raise damaged(path, "the sizes of its compressed blocks cannot be")
    if compressed > header.file_size:
        raise truncated(path, "its compressed blocks are longer than the file")
