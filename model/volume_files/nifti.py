"""NIfTI files (.nii, .nii.gz), read by VTK."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.volume import Triple
from model.volume_files.anatomy import axis_labels
from model.volume_files.checks import check_grid, check_present
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.frame import frame_notes, usable_origin, usable_spacing
from model.volume_files.grid import Grid
from model.volume_files.vtk_session import run_quietly, to_numpy


def read_nifti(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read a NIfTI file; time steps and vectors become components.

    The header's intensity scaling is applied. VTK reverses the slices of a
    left-handed grid, which is noted.

    Raises
    ------
    VolumeError
        When the file is foreign, damaged or truncated.
    """
    from vtkmodules.util.numpy_support import get_vtk_to_numpy_typemap
    from vtkmodules.vtkIOImage import vtkNIFTIImageReader

    reader = vtkNIFTIImageReader()
    if not reader.CanReadFile(str(path)):
        raise VolumeError(
            f"{path}: this is not a NIfTI file, or its header is truncated; choose another."
        )
    reader.SetFileName(str(path))
    reader.TimeAsVectorOn()
    run_quietly(path, reader.UpdateInformation)
    header = reader.GetNIFTIHeader()
    dimensions = [header.GetDim(axis) for axis in range(1, 4)]
    dtype = np.dtype(get_vtk_to_numpy_typemap()[reader.GetDataScalarType()])
    need = check_grid(path, dimensions, dtype, reader.GetNumberOfScalarComponents())
    if path.suffix.lower() != ".gz":
        check_present(path, path.stat().st_size - int(header.GetVoxOffset()), need)
    run_quietly(path, reader.Update)

    image = reader.GetOutput()
    values = to_numpy(image.GetPointData().GetScalars(), image.GetDimensions())
    values = _rescaled(values, reader.GetRescaleSlope(), reader.GetRescaleIntercept())
    spacing, notes = usable_spacing(reader.GetDataSpacing())
    origin, frame, labels = _frame(reader)
    if reader.GetQFac() < 0:
        notes += ("The grid is left-handed, so its slices are read in reverse order.",)
    return Grid(values, spacing, origin, notes=notes + frame, axis_labels=labels)


def _rescaled(values: NDArray[np.generic], slope: float, intercept: float) -> NDArray[np.generic]:
    """Apply the header's intensity scaling; a slope of 0 means none."""
    if slope == 0 or not np.isfinite([slope, intercept]).all() or (slope, intercept) == (1, 0):
        return values
    wide = values.dtype.itemsize > 4 or values.dtype in (np.int32, np.uint32)
    scaled: NDArray[np.floating] = values.astype(np.float64 if wide else np.float32)
    scaled *= slope
    scaled += intercept
    return scaled


def _frame(reader: Any) -> tuple[Triple, tuple[str, ...], tuple[str, ...]]:
    """Return the origin, notes on the orientation, and labels, from the header's matrix (RAS).

    VTK's matrix is that of the slices in the order in which it reads them.
    """
    matrix = reader.GetSFormMatrix() or reader.GetQFormMatrix()
    if matrix is None:
        return (0.0, 0.0, 0.0), (), ()
    rows = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(3)])
    directions = rows[:, :3].T
    labels = axis_labels(directions, "RAS")
    # Scanners write upright grids in two ways: x and y both positive, or both negative.
    if directions[0, 0] < 0 and directions[1, 1] < 0:
        directions = directions * (-1.0, -1.0, 1.0)
    return usable_origin(rows[:, 3].tolist()), frame_notes(directions), labels
