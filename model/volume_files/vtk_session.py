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

from model.volume_files.checks import damaged

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
    step : callable
        For example ``reader.Update``.
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
