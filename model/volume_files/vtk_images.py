"""VTK's images in legacy and XML files, by VTK: arrays at points or in cells, ghost types."""

from __future__ import annotations

import base64
import math
import re
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.volume_files import checks
from model.volume_files.arrays import StoredArray, grid_of_arrays
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.grid import Grid

LONGEST_HEADER = 1 << 20
GHOSTS, VALID = ("vtkGhostType", "vtkGhostLevels"), "vtkValidPointMask"
HIDDEN_POINT, HIDDEN_CELL = 2, 32  # bits of ghost types

_OUTPUT_WINDOW = threading.Lock()  # guards VTK's output window, one per process
_MESSAGE = re.compile(
    r"^(ERROR|Generic Warning): In [^\n]*\n(?:\w+ \(0x[0-9a-f]+\): )?([^\n]+)", re.MULTILINE
)


class VtkArray(NamedTuple):
    """An array at an image's points or in its cells."""

    name: str
    in_cells: bool
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[..., NDArray[Any]]
    is_active: bool = False


def image_arrays(
    found: Sequence[VtkArray],
    first: Sequence[float],
    spacing: Sequence[float] | None,
    origin: Sequence[float],
    directions: NDArray[np.float64],
    notes: tuple[str, ...] = (),
) -> list[StoredArray]:
    """Place arrays of an image by its frame and the number of its first point along each axis."""
    points = {array.name for array in found if not array.in_cells}
    arrays = []
    for name, in_cells, shape, dtype, read, is_active in found:
        place = np.array(first) + in_cells / 2
        place = place * (1.0 if spacing is None else np.array(spacing)) @ directions + origin
        title = f"{name or 'unnamed'}{' (cells)' if in_cells and name in points else ''}"
        its_notes = (f"The values of '{name}' belong to cells; each is a voxel.",) * in_cells
        arrays.append(
            StoredArray(
                title,
                shape,
                dtype,
                read,
                ("z", "y", "x", "components")[: len(shape)],
                spacing=spacing,
                origin=place.tolist(),
                directions=directions,
                notes=its_notes + notes,
                is_active=is_active,
            )
        )
    return arrays


def _checked(path: Path, found: list[VtkArray]) -> list[VtkArray]:
    """Return the arrays that are no ghost types, or raise VolumeError."""
    if any(not isinstance(array.name, str) for array in found):
        # VTK gives bytes where it cannot decode them.
        raise checks.damaged(path, "the name of an array is no text")
    found = [array for array in found if array.name not in (*GHOSTS, VALID)]
    if not found:
        raise VolumeError(
            f"{path}: the file holds no values, neither at the grid's points nor in its cells; "
            "save it with an array."
        )
    return found


def _voxels(
    path: Path, image: Any, name: str, in_cells: bool, extent: Sequence[int] | None, _: Any
) -> NDArray[Any]:
    """Return an image's array within an extent of points, with hidden ghosts masked."""
    attributes = image.GetCellData() if in_cells else image.GetPointData()
    array = attributes.GetArray(name) if name else attributes.GetArray(0)
    dimensions = [n - in_cells for n in image.GetDimensions()]
    if array is None or array.GetNumberOfTuples() != math.prod(dimensions):
        raise checks.damaged(path, f"its array '{name}' has no values, or not those of its grid")
    values, hidden = _to_numpy(array, dimensions), _hidden(attributes, dimensions, in_cells)
    if extent is not None:
        ends = zip(extent[::2], extent[1::2], image.GetExtent()[::2], strict=True)
        part = tuple(slice(low - at, high - at + 1 - in_cells) for low, high, at in ends)[::-1]
        values, hidden = values[part], None if hidden is None else hidden[part]
    if hidden is None:
        return values
    hidden = hidden if values.ndim == 3 else hidden[..., None]
    return np.ma.array(values, mask=np.broadcast_to(hidden, values.shape))


def _hidden(attributes: Any, dimensions: Sequence[int], in_cells: bool) -> NDArray[np.bool_] | None:
    """Return the values that ghost types or a mask of valid points hide."""
    hidden: NDArray[np.bool_] | None = None
    for name in (GHOSTS[0], VALID):
        array = attributes.GetArray(name)
        if array is None or array.GetNumberOfTuples() != math.prod(dimensions):
            continue
        flags: NDArray[Any] = _to_numpy(array, dimensions)
        if flags.ndim != 3 or flags.dtype.kind not in "iu":
            continue
        bit = flags.dtype.type(HIDDEN_CELL if in_cells else HIDDEN_POINT)
        found = flags == 0 if name == VALID else (flags & bit) != 0
        hidden = found if hidden is None else hidden | found
    return hidden if hidden is not None and hidden.any() else None


def _run_quietly(path: Path, step: Callable[[], None]) -> None:
    """Run one step of a VTK reader, such as ``reader.Update``; its errors are damage."""
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
        raise checks.damaged(path, f"VTK says '{reason}'")


def _to_numpy(array: Any, dimensions: Sequence[int]) -> NDArray[np.generic]:
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
        raise checks.not_a(path, "a legacy VTK file")
    kind = re.search(rb"(?mi)^DATASET\s+(\w+)", start)
    if kind is not None and kind.group(1).upper() != b"STRUCTURED_POINTS":
        raise VolumeError(
            f"{path}: the file holds {kind.group(1).decode('latin-1').lower()}, not "
            "structured_points; make image data of it first, with ParaView's filter Resample To "
            "Image, and save that as .vti."
        )
    sizes = re.search(rb"(?mi)^DIMENSIONS\s+(-?\d{1,18})\s+(-?\d{1,18})\s+(-?\d{1,18})\s", start)
    if kind is None or sizes is None:
        raise checks.truncated(path, "its header has no dimensions")
    dimensions = [int(size) for size in sizes.groups()]
    checks.check_present(path, path.stat().st_size, checks.check_grid(path, dimensions, np.uint8))
    reader = vtkStructuredPointsReader()
    reader.SetFileName(str(path))
    reader.ReadAllScalarsOn()
    reader.ReadAllVectorsOn()
    reader.ReadAllFieldsOn()
    _run_quietly(path, reader.Update)
    image = reader.GetOutput()
    found = _checked(path, [*_arrays(path, image, False), *_arrays(path, image, True)])
    frame = image.GetExtent()[::2], image.GetSpacing(), image.GetOrigin(), np.eye(3)
    return grid_of_arrays(path, image_arrays(found, *frame), choice, "legacy VTK")


def _arrays(path: Path, image: Any, in_cells: bool) -> Iterator[VtkArray]:
    """Yield the arrays of an image's points or cells."""
    attributes = image.GetCellData() if in_cells else image.GetPointData()
    active = attributes.GetScalars()
    shape = tuple(n - in_cells for n in image.GetDimensions()[::-1])
    for number in range(attributes.GetNumberOfArrays()):
        array = attributes.GetArray(number)
        if array is None or not array.GetNumberOfTuples():
            continue
        name, components = array.GetName() or "", array.GetNumberOfComponents()
        is_active = active is not None and array.GetName() == active.GetName()
        dtype = _to_numpy(array, (array.GetNumberOfTuples(),)).dtype
        read = partial(_voxels, path, image, name, in_cells, None)
        more = (components,) if components > 1 else ()
        yield VtkArray(name, in_cells, (*shape, *more), dtype, read, is_active)


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
    from vtkmodules.vtkCommonDataModel import vtkDataObject
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    with path.open("rb") as file:
        header = _read_header(path, file)
        whole = _whole_extent(path, header)
        if header.compressor:
            for start in _compressed_arrays(path, header):
                _check_blocks(path, file, header, *start)
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    _run_quietly(path, reader.UpdateInformation)
    own = _own_extent(path, header, whole)
    extent, notes = own or whole, tuple[str, ...]()
    if own is not None:
        points = checks.times(
            [high - low + 1 for low, high in zip(whole[::2], whole[1::2], strict=True)]
        )
        notes = (f"The file has a piece of a whole of {points} points; the piece is read.",)
    found = _checked(path, [*_announced(path, reader, extent)])
    said = reader.GetOutputInformation(0)
    spacing = said.Get(vtkDataObject.SPACING()) if header.attribute("Spacing") else None
    # Column k of the matrix is the direction of axis k.
    directions = np.array(said.Get(vtkDataObject.DIRECTION())).reshape(3, 3).T
    origin = said.Get(vtkDataObject.ORIGIN())
    arrays = image_arrays(found, extent[::2], spacing, origin, directions, notes)
    return grid_of_arrays(path, arrays, choice, "VTI")


def _announced(path: Path, reader: Any, extent: Sequence[int]) -> Iterator[VtkArray]:
    """Yield the arrays that VTK finds in a file's header, without texts."""
    from vtkmodules.util.numpy_support import get_vtk_to_numpy_typemap
    from vtkmodules.vtkCommonDataModel import vtkDataObject

    data: Any = vtkDataObject
    types, said = get_vtk_to_numpy_typemap(), reader.GetOutputInformation(0)
    ends = [*zip(extent[::2], extent[1::2], strict=True)][::-1]
    for in_cells, kind in ((False, data.POINT_DATA_VECTOR()), (True, data.CELL_DATA_VECTOR())):
        listed = said.Get(kind)
        for number in range(0 if listed is None else listed.GetNumberOfInformationObjects()):
            array = listed.GetInformationObject(number)
            dtype = types.get(array.Get(data.FIELD_ARRAY_TYPE()))
            if dtype is None:
                continue
            name = array.Get(data.FIELD_NAME())
            components = array.Get(data.FIELD_NUMBER_OF_COMPONENTS())
            shape = tuple(high - low + 1 - in_cells for low, high in ends)
            shape += (components,) if components > 1 else ()
            is_active = bool(array.Get(data.FIELD_ACTIVE_ATTRIBUTE()) & 1)
            read = partial(_read_xml, path, reader, name, in_cells, extent)
            yield VtkArray(name, in_cells, shape, np.dtype(dtype), read, is_active)


def _read_xml(
    path: Path, reader: Any, name: str, in_cells: bool, extent: Sequence[int], index: Any
) -> NDArray[Any]:
    """Read one array, and its ghost types or valid points."""
    selections = reader.GetPointDataArraySelection(), reader.GetCellDataArraySelection()
    for its_cells, selection in enumerate(selections):
        selection.DisableAllArrays()
        for wanted in (name, *GHOSTS, VALID):
            if its_cells == in_cells and selection.ArrayExists(wanted):
                selection.EnableArray(wanted)
    _run_quietly(path, reader.Update)
    return _voxels(path, reader.GetOutput(), name, in_cells, extent, index)


def _integers(text: str) -> list[int]:
    return [int(number) for number in re.findall(r"-?\d{1,18}", text)]


def _own_extent(path: Path, header: _Header, whole: list[int]) -> list[int] | None:
    """Return the extent of the file's pieces if it is less than the whole."""
    extents = re.findall(r"""<Piece\b[^>]*\bExtent\s*=\s*["']([^"']*)["']""", header.text)
    pieces = [*map(_integers, extents)]
    if not pieces or any(len(piece) != 6 for piece in pieces):
        return None
    own = [(min if k % 2 == 0 else max)(piece[k] for piece in pieces) for k in range(6)]
    if own == whole:
        return None
    if any(own[k] < whole[k] or own[k + 1] > whole[k + 1] for k in (0, 2, 4)):
        raise checks.damaged(path, "a piece lies outside the whole extent")
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
        raise checks.not_a(path, "VTK image data in XML")
    # VTK does not detect truncated raw appended data.
    if b"</VTKFile>" not in tail:
        raise checks.truncated(path, "its closing tag is missing")
    return _Header(start.decode("latin-1"), size)


def _whole_extent(path: Path, header: _Header) -> list[int]:
    """Return the extent, checked against memory and file; refuse bits, which VTK packs."""
    ends = _integers(header.attribute("WholeExtent"))
    if len(ends) != 6:
        raise checks.damaged(path, "its header has no extent of six numbers")
    if re.search(r"""<DataArray\b[^>]*\btype\s*=\s*["']Bit["']""", header.text):
        raise checks.unsupported(
            path, "an array of bits", "convert it to unsigned char, with ParaView's Calculator"
        )
    dimensions = [last - first + 1 for first, last in zip(ends[::2], ends[1::2], strict=True)]
    checks.check_present(path, header.capacity, checks.check_grid(path, dimensions, np.uint8))
    return ends


def _compressed_arrays(path: Path, header: _Header) -> list[tuple[int, bool]]:
    """Return the first byte of each compressed array, and True if it is in base64."""
    # VTK takes the first one in its raw text, even within a comment.
    first = header.text.find("<AppendedData")
    appended = re.compile(r"<AppendedData\b[^>]*>\s*_").match(header.text, max(first, 0))
    if first >= 0 and appended is None:
        raise checks.damaged(path, "its appended data does not begin with an underscore")
    starts = []
    for array in re.finditer(r"<DataArray\b[^>]*>", header.text):
        offset = header.attribute("offset", array.group())
        form = header.attribute("format", array.group())
        if form == "appended" and appended and re.fullmatch(r"\d{1,18}", offset):
            encoded = header.attribute("encoding", appended.group()) != "raw"
            starts.append((appended.end() + int(offset), encoded))
        elif form == "binary":
            text = header.text[array.end() :]
            starts.append((array.end() + len(text) - len(text.lstrip()), True))
        elif form != "ascii":
            raise checks.damaged(path, "an array does not say where its values are")
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
            raise checks.damaged(path, f"an array claims {blocks} compressed blocks")
        compressed = sum(numbers(3 + blocks)[3:])
    except ValueError:
        raise checks.damaged(path, "a compressed array has no header") from None
    unpacked = (blocks - 1) * block + (last or block)
    if blocks and (block == 0 or last > block or unpacked > header.capacity):
        raise checks.damaged(path, "the sizes of its compressed blocks cannot be")
    if compressed > header.file_size:
        raise checks.truncated(path, "its compressed blocks are longer than the file")
