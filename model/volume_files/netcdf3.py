"""NetCDF-3 files, read by SciPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from model.errors import VolumeError, first_line
from model.volume_files.arrays import StoredArray, attribute_text, grid_of_arrays
from model.volume_files.cf import coordinate_step, described
from model.volume_files.checks import damaged
from model.volume_files.choice import Choice
from model.volume_files.grid import Grid
from model.volume_files.library_log import log_of


def read_netcdf3(path: Path, choice: Choice) -> Grid:
    """Read an array of a NetCDF-3 file.

    Raises
    ------
    VolumeError
        When the file is damaged, or holds no volume.
    """
    from scipy.io import netcdf_file

    with log_of("scipy"):
        try:
            # Mapped, so that only what is chosen is read.
            with netcdf_file(path, "r", mmap=True, maskandscale=False) as file:
                arrays = [_array(file, name, v) for name, v in file.variables.items()]
                grid = grid_of_arrays(path, arrays, choice, "NetCDF-3")
                del arrays
                return grid
        except (OSError, MemoryError, VolumeError):
            raise
        except Exception as error:
            raise damaged(path, f"SciPy says '{first_line(error)}'") from None


def _array(file: Any, name: str, variable: Any) -> StoredArray:
    attributes = variable._attributes
    steps: list[float | None] = []
    units: list[str] = []
    starts: list[float] = []
    notes: tuple[str, ...] = ()
    for axis in variable.dimensions:
        step, start, unit = None, 0.0, ""
        scale = file.variables.get(axis)
        if scale is not None and len(scale.shape) == 1:
            unit = attribute_text(scale._attributes, "units")
            step, start, unit, said = coordinate_step(np.array(scale[:]), unit, axis)
            notes += said
        steps.append(step)
        units.append(unit)
        starts.append(start)
    data = variable.data
    return StoredArray(
        name,
        tuple(int(n) for n in variable.shape),
        np.dtype(data.dtype),
        # A copy: the file is closed when it is used.
        lambda index: np.array(data[index], np.dtype(data.dtype).newbyteorder("=")),
        tuple(variable.dimensions),
        tuple(steps),
        tuple(units),
        tuple(starts),
        notes=notes if len(variable.shape) > 2 else (),
        **described(attributes),
    )
