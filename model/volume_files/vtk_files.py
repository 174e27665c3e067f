"""VTK's own files: image data in XML (.vti) and legacy structured points (.vtk)."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from model.errors import VolumeError
from model.volume_files.checks import (
    check_grid,
    check_present,
    damaged,
    frame_notes,
    truncated,
    usable_origin,
    usable_spacing,
)
from model.volume_files.grid import Grid
from model.volume_files.vtk_session import run_quietly, to_numpy

LONGEST_HEADER = 1 << 20
TAIL = 1 << 12


def read_vti(path: Path) -> Grid:
    """Read VTK image data in XML: ASCII, base64 or raw, compressed or not.

    Raises
    ------
    VolumeError
        When the file is foreign, damaged, truncated, or holds no array.
    """
    from vtkmodules.vtkIOXML import vtkXMLImageDataReader

    start, tail = _ends(path)
    if b"<VTKFile" not in start or b"ImageData" not in start:
        raise VolumeError(
            f"{path}: this is not VTK image data in XML; choose another or correct its suffix."
        )
    # VTK does not notice when raw appended data stop early.
    if b"</VTKFile>" not in tail:
        raise truncated(path, "its closing tag is missing")
    _check_vti_extent(path, start)
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    run_quietly(path, reader.Update)
    return _grid(path, reader.GetOutput())


def read_legacy_vtk(path: Path) -> Grid:
    """Read legacy VTK structured points, binary or ASCII.

    Raises
    ------
    VolumeError
        When the file is foreign, damaged, truncated, or holds another kind of
        data set or no array.
    """
    from vtkmodules.vtkIOLegacy import vtkStructuredPointsReader

    start, _ = _ends(path)
    if not start.startswith(b"# vtk DataFile"):
        raise VolumeError(
            f"{path}: this is not a legacy VTK file; choose another or correct its suffix."
        )
    kind = re.search(rb"^DATASET\s+(\w+)", start, re.MULTILINE | re.IGNORECASE)
    if kind is not None and kind.group(1).upper() != b"STRUCTURED_POINTS":
        raise VolumeError(
            f"{path}: the file holds {kind.group(1).decode().lower()}, not structured_points; "
            "resample it to image data first."
        )
    sizes = re.search(
        rb"^DIMENSIONS\s+(-?\d{1,18})\s+(-?\d{1,18})\s+(-?\d{1,18})\s",
        start,
        re.MULTILINE | re.IGNORECASE,
    )
    if kind is None or sizes is None:
        raise truncated(path, "its header has no dimensions")
    check_present(path, path.stat().st_size, check_grid(path, _integers(sizes.groups()), np.uint8))
    reader = vtkStructuredPointsReader()
    reader.SetFileName(str(path))
    run_quietly(path, reader.Update)
    return _grid(path, reader.GetOutput())


def _ends(path: Path) -> tuple[bytes, bytes]:
    """First and last bytes of a file."""
    with path.open("rb") as file:
        start = file.read(LONGEST_HEADER)
        file.seek(max(path.stat().st_size - TAIL, 0))
        return start, file.read()


def _integers(words: tuple[bytes, ...] | list[bytes]) -> list[int]:
    return [int(word) for word in words]


def _check_vti_extent(path: Path, start: bytes) -> None:
    """Compare the extent with the memory and, for plain binary data, with the file's size."""
    extent = re.search(rb"WholeExtent\s*=\s*[\"']([-\d\s]+)[\"']", start)
    ends = _integers(extent.group(1).split()) if extent else []
    if len(ends) != 6:
        raise damaged(path, "its header has no extent of six numbers")
    dimensions = [last - first + 1 for first, last in zip(ends[::2], ends[1::2], strict=True)]
    voxels = check_grid(path, dimensions, np.uint8)
    if b"compressor=" not in start:
        check_present(path, path.stat().st_size, voxels)


def _grid(path: Path, image: Any) -> Grid:
    """Take the active scalars, or else the first array, from VTK's image."""
    points = image.GetPointData()
    arrays = [points.GetArray(index) for index in range(points.GetNumberOfArrays())]
    array = points.GetScalars() or next((array for array in arrays if array is not None), None)
    if array is None or array.GetNumberOfTuples() == 0:
        cells = " per cell" if image.GetCellData().GetNumberOfArrays() else ""
        what = f"only values{cells}" if cells else "no values"
        raise VolumeError(
            f"{path}: the file holds {what}, not at the grid's points; save it with point data."
        )
    others = [other.GetName() for other in arrays if other and other.GetName() != array.GetName()]
    matrix = image.GetDirectionMatrix()
    directions = np.array([[matrix.GetElement(r, c) for r in range(3)] for c in range(3)])
    spacing, notes = usable_spacing(image.GetSpacing())
    notes += frame_notes(directions)
    if others:
        notes += (f"Array '{array.GetName()}' is read; the file also holds {', '.join(others)}.",)
    values = to_numpy(array, image.GetDimensions())
    first_voxel = image.GetExtent()[::2]
    origin = np.array(image.GetOrigin()) + np.multiply(first_voxel, image.GetSpacing())
    return Grid(values, spacing, usable_origin(origin.tolist()), notes=notes)
