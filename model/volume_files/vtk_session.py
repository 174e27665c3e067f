"""Quiet use of VTK's readers, with their error messages raised as exceptions."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.volume_files.checks import damaged
from model.volume_files.frame import frame_notes, usable_origin, usable_spacing
from model.volume_files.grid import Grid

_OUTPUT_WINDOW = threading.Lock()
"""Guards VTK's output window, of which there is one per process."""

_MESSAGE = re.compile(
    r"^(ERROR|Generic Warning): In [^\n]*\n(?:\w+ \(0x[0-9a-f]+\): )?([^\n]+)", re.MULTILINE
)


@contextmanager
def _captured_messages() -> Iterator[Callable[[], str | bytes]]:
    """Capture VTK's messages; yield a function that returns them, as bytes if not UTF-8."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    with _OUTPUT_WINDOW:
        window, verbosity = vtkOutputWindow.GetInstance(), vtkLogger.GetCurrentVerbosityCutoff()
        diverted = vtkStringOutputWindow()
        vtkOutputWindow.SetInstance(diverted)
        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
        try:
            yield diverted.GetOutput
        finally:
            vtkLogger.SetStderrVerbosity(verbosity)
            vtkOutputWindow.SetInstance(window)


def run_quietly(path: Path, step: Callable[[], None]) -> None:
    """Run one step of a VTK reader.

    Parameters
    ----------
    path : Path
        Path named in the error message.
    step : callable
        For example ``reader.Update``.

    Raises
    ------
    VolumeError
        When VTK reports an error; the message contains VTK's first one.
    """
    with _captured_messages() as messages:
        step()
        text = messages()
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    complaint = _MESSAGE.search(text)
    if complaint is not None:
        reason = complaint.group(2).strip().rstrip(".!").replace(str(path), path.name)
        raise damaged(path, f"VTK says '{reason}'")


def to_numpy(array: Any, dimensions: tuple[int, int, int]) -> NDArray[np.generic]:
    """View a VTK array's memory as voxels.

    Returns
    -------
    ndarray, shape (nz, ny, nx) or (nz, ny, nx, components)
        A view that keeps the array's memory alive.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy

    values: NDArray[np.generic] = vtk_to_numpy(array)
    return values.reshape(*dimensions[::-1], *values.shape[1:])


def image_grid(path: Path, image: Any) -> Grid:
    """Return the active scalars, or else the first array, of a VTK image as a grid.

    Raises
    ------
    VolumeError
        When there is no array with values at the points.
    """
    points = image.GetPointData()
    arrays = [points.GetArray(index) for index in range(points.GetNumberOfArrays())]
    array = points.GetScalars() or next((array for array in arrays if array is not None), None)
    if array is None or array.GetNumberOfTuples() == 0:
        what = "only values per cell" if image.GetCellData().GetNumberOfArrays() else "no values"
        raise VolumeError(
            f"{path}: the file holds {what}, but a volume needs values at the grid's points; "
            "save it with point data."
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
