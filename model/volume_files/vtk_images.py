"""Images by VTK: legacy files of structured points, arrays at points or in cells, ghost types."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.volume import Content, FileFacts
from model.volume_files.arrays import is_auxiliary
from model.volume_files.checks import check_grid, check_present, damaged, not_a, truncated
from model.volume_files.choice import LARGEST, Choice, choice_notes, chosen_index
from model.volume_files.grid import Grid, placed, usable_origin

LONGEST_HEADER = 1 << 16
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
        notes=choice_notes(listed) + notes,
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
