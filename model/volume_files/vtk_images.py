"""VTK's images in legacy and XML files, by VTK: arrays at points or in cells, ghost types."""

from __future__ import annotations

import base64
import math
import re
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.volume import Content, FileFacts
from model.volume_files.arrays import is_auxiliary
from model.volume_files.checks import (
    check_grid,
    check_present,
    damaged,
    not_a,
    times,
    truncated,
    unsupported,
)
from model.volume_files.choice import LARGEST, Choice, chosen_index
from model.volume_files.grid import Grid, placed, usable_origin, usable_spacing

LONGEST_HEADER = 1 << 20
GHOSTS, VALID = ("vtkGhostType", "vtkGhostLevels"), "vtkValidPointMask"
HIDDEN_POINT, HIDDEN_CELL = 2, 32  # bits of ghost types


_OUTPUT_WINDOW = threading.Lock()  # guards VTK's output window, of which there is one per process
_MESSAGE = re.compile(
    r"^(ERROR|Generic Warning): In [^\n]*\n(?:\w+ \(0x[0-9a-f]+\): )?([^\n]+)", re.MULTILINE
)


@dataclass(frozen=True)
class VtkArray:
    """An array of a file, of points or cells; without a type where only reading would tell it."""

    name: str
    in_cells: bool
    dtype: np.dtype[np.generic] | None
    components: int = 1
    is_active: bool = False

    @property
    def is_ghost(self) -> bool:
        """Whether it only tells which voxels there are."""
        return self.name in (*GHOSTS, VALID)


def chosen_array(
    path: Path, arrays: Sequence[VtkArray], choice: Choice
) -> tuple[VtkArray, list[VtkArray]]:
    """Return the chosen array, and all that can be chosen.

    By default it is the first that is no list of ids, ghost types or mask; the active scalars
    before others, and arrays at points before those in cells.
    """
    if any(not isinstance(array.name, str) for array in arrays):
        # VTK gives bytes where it cannot decode them.
        raise damaged(path, "the name of an array is no text")
    usable = [array for array in arrays if not array.is_ghost]
    if not usable:
        raise VolumeError(
            f"{path}: the file holds no values, neither at the grid's points nor in its cells; "
            "save it with an array."
        )
    usable.sort(key=lambda array: (is_auxiliary(array.name), not array.is_active, array.in_cells))
    names = [_title(array, usable) for array in usable]
    number = chosen_index(path, "array", names, choice.array)
    return usable[number], usable


def _title(array: VtkArray, arrays: Sequence[VtkArray]) -> str:
    name = array.name or "unnamed"
    twice = sum(other.name == array.name for other in arrays) > 1
    return f"{name} (cells)" if array.in_cells and twice else name


def image_grid(
    path: Path,
    image: Any,
    wanted: VtkArray,
    arrays: Sequence[VtkArray],
    file_format: str,
    extent: Sequence[int] | None = None,
) -> Grid:
    """Return an array of a VTK image as a grid, or the part of it within an extent of points."""
    attributes = image.GetCellData() if wanted.in_cells else image.GetPointData()
    array = attributes.GetArray(wanted.name) if wanted.name else attributes.GetArray(0)
    less = 1 if wanted.in_cells else 0
    dimensions = [n - less for n in image.GetDimensions()]
    if array is None or array.GetNumberOfTuples() != int(np.prod(dimensions)):
        raise damaged(path, f"its array '{wanted.name}' has no values, or not those of its grid")
    values = to_numpy(array, tuple(dimensions))
    check_grid(path, dimensions, values.dtype, values.shape[3] if values.ndim == 4 else 1)
    missing = _hidden(attributes, dimensions, wanted.in_cells)
    first = list(image.GetExtent()[::2])
    if extent is not None:
        starts = [extent[2 * k] - first[k] for k in range(3)]
        stops = [extent[2 * k + 1] - first[k] + 1 - less for k in range(3)]
        part = tuple(slice(starts[k], stops[k]) for k in (2, 1, 0))
        values = values[part]
        missing = None if missing is None else missing[part]
        first = [extent[0], extent[2], extent[4]]
    matrix = image.GetDirectionMatrix()
    directions = np.array([[matrix.GetElement(r, c) for r in range(3)] for c in range(3)])
    steps = list(image.GetSpacing())
    place = [at + less / 2 for at in first]
    origin = np.array(image.GetOrigin()) + np.multiply(place, steps) @ directions
    notes: tuple[str, ...] = ()
    if wanted.in_cells:
        notes = (f"The values of '{wanted.name}' belong to cells; each is a voxel.",)
    listed = _contents(wanted, arrays, image, values)
    grid = Grid(
        values,
        origin=usable_origin(origin.tolist()),
        notes=notes,
        missing=missing,
        facts=FileFacts(file_format, contents=listed),
    )
    return placed(grid, steps, directions)


def _hidden(attributes: Any, dimensions: Sequence[int], in_cells: bool) -> NDArray[np.bool_] | None:
    """Return where values are blanked by ghost types or a mask of valid points."""
    size = int(np.prod(dimensions))
    hidden: NDArray[np.bool_] | None = None
    for name in (GHOSTS[0], VALID):
        array = attributes.GetArray(name)
        if array is None or array.GetNumberOfTuples() != size:
            continue
        flags = to_numpy(array, tuple(dimensions))  # type: ignore[arg-type]
        if flags.ndim != 3 or flags.dtype.kind not in "iu":
            continue
        bit = flags.dtype.type(HIDDEN_CELL if in_cells else HIDDEN_POINT)
        found = flags == 0 if name == VALID else (flags & bit) != 0  # type: ignore[operator]
        hidden = found if hidden is None else hidden | found
    return hidden if hidden is not None and hidden.any() else None


def _contents(
    wanted: VtkArray, arrays: Sequence[VtkArray], image: Any, values: NDArray[np.generic]
) -> tuple[Content, ...]:
    """List all arrays."""
    if len(arrays) < 2:
        return ()
    listed = []
    for array in arrays:
        nx, ny, nz = (n - array.in_cells for n in image.GetDimensions())
        dtype = array.dtype
        if array is wanted:
            nz, ny, nx = values.shape[:3]
            dtype = values.dtype
        size = 0 if dtype is None else nx * ny * nz * dtype.itemsize * array.components
        name, title = "" if dtype is None else dtype.name, _title(array, arrays)
        listed.append(Content("array", title, (nx, ny, nz), name, size, array is wanted))
    return tuple(listed)


def run_quietly(path: Path, step: Callable[[], None]) -> None:
    """Run one step of a VTK reader, such as ``reader.Update``; its complaint is damage."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    with _OUTPUT_WINDOW:
        window, verbosity = vtkOutputWindow.GetInstance(), vtkLogger.GetCurrentVerbosityCutoff()
        diverted = vtkStringOutputWindow()
        vtkOutputWindow.SetInstance(diverted)
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
        try:
            step()
        finally:
            vtkLogger.SetStderrVerbosity(verbosity)
            vtkOutputWindow.SetInstance(window)
    text: str | bytes = diverted.GetOutput()
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    complaint = _MESSAGE.search(text)
    if complaint is not None:
        reason = complaint.group(2).strip().rstrip(".!").replace(str(path), path.name)
        raise damaged(path, f"VTK says '{reason}'")


def to_numpy(array: Any, dimensions: tuple[int, int, int]) -> NDArray[np.generic]:
    """View a VTK array's memory as voxels, components last; the view keeps it alive."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    values: NDArray[np.generic] = vtk_to_numpy(array)
    return values.reshape(*dimensions[::-1], *values.shape[1:])


# --- legacy files -------------------------------------------------------------------------


def read_legacy_vtk(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read legacy VTK structured points, binary or ASCII."""
    from vtkmodules.vtkIOLegacy import vtkStructuredPointsReader

    with path.open("rb") as file:
        start = file.read(LONGEST_HEADER)
    if not start.startswith(b"# vtk DataFile"):
        raise not_a(path, "a legacy VTK file")
    kind = re.search(rb"^DATASET\s+(\w+)", start, re.MULTILINE | re.IGNORECASE)
    if kind is not None and kind.group(1).upper() != b"STRUCTURED_POINTS":
        raise VolumeError(
            f"{path}: the file holds {kind.group(1).decode('latin-1').lower()}, not "
            "structured_points; make image data of it first, as with ParaView's filter Resample To "
            "Image, and save that as .vti."
        )
    sizes = re.search(
        rb"^DIMENSIONS\s+(-?\d{1,18})\s+(-?\d{1,18})\s+(-?\d{1,18})\s",
        start,
        re.MULTILINE | re.IGNORECASE,
    )
    if kind is None or sizes is None:
        raise truncated(path, "its header has no dimensions")
    dimensions = [int(size) for size in sizes.groups()]
    check_present(path, path.stat().st_size, check_grid(path, dimensions, np.uint8))
    reader = vtkStructuredPointsReader()
    reader.SetFileName(str(path))
    reader.ReadAllScalarsOn()
    reader.ReadAllVectorsOn()
    reader.ReadAllFieldsOn()
    run_quietly(path, reader.Update)
    image = reader.GetOutput()
    arrays = [*_arrays(image.GetPointData(), False), *_arrays(image.GetCellData(), True)]
    return image_grid(path, image, *chosen_array(path, arrays, choice), "legacy VTK")


def _arrays(attributes: Any, in_cells: bool) -> list[VtkArray]:
    """List the arrays of points or cells."""
    active = attributes.GetScalars()
    numbers = range(attributes.GetNumberOfArrays())
    found = [array for array in map(attributes.GetArray, numbers) if array is not None]
    return [
        VtkArray(
            array.GetName() or "",
            in_cells,
            to_numpy(array, (array.GetNumberOfTuples(), 1, 1)).dtype,
            array.GetNumberOfComponents(),
            active is not None and array.GetName() == active.GetName(),
        )
        for array in found
        if array.GetNumberOfTuples()
    ]


# --- XML files --------------------------------------------------------------------------

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
    chosen, arrays = chosen_array(path, _xml_arrays(reader, header), choice)
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


def _xml_arrays(reader: Any, header: _Header) -> list[VtkArray]:
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
