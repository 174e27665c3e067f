"""Legacy VTK files (.vtk) of structured points, read by VTK."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from model.errors import VolumeError
from model.volume_files.checks import check_grid, check_present, truncated
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.grid import Grid
from model.volume_files.vtk_arrays import VtkArray, chosen_array, image_grid
from model.volume_files.vtk_session import run_quietly, to_numpy

LONGEST_HEADER = 1 << 16


def read_legacy_vtk(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read legacy VTK structured points, binary or ASCII."""
    from vtkmodules.vtkIOLegacy import vtkStructuredPointsReader

    with path.open("rb") as file:
        start = file.read(LONGEST_HEADER)
    if not start.startswith(b"# vtk DataFile"):
        raise VolumeError(
            f"{path}: this is not a legacy VTK file; choose another or correct its suffix."
        )
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
    arrays = [
        *_arrays(image.GetPointData(), in_cells=False),
        *_arrays(image.GetCellData(), in_cells=True),
    ]
    return image_grid(path, image, *chosen_array(path, arrays, choice), "legacy VTK")


def _arrays(attributes: Any, in_cells: bool) -> list[VtkArray]:
    """List the arrays of points or cells."""
    found = []
    active = attributes.GetScalars()
    for number in range(attributes.GetNumberOfArrays()):
        array = attributes.GetArray(number)
        if array is not None and array.GetNumberOfTuples():
            dtype = to_numpy(array, (array.GetNumberOfTuples(), 1, 1)).dtype
            found.append(
                VtkArray(
                    array.GetName() or "",
                    in_cells,
                    dtype,
                    array.GetNumberOfComponents(),
                    active is not None and array.GetName() == active.GetName(),
                )
            )
    return found
