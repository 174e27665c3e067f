"""NetCDF-3 files, read by SciPy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from model.volume_files.arrays import StoredArray, attribute_text, grid_of_arrays
from model.volume_files.cf import described, placed
from model.volume_files.choice import Choice
from model.volume_files.grid import Grid
from model.volume_files.library_log import errors_of


def read_netcdf3(path: Path, choice: Choice) -> Grid:
    """Read an array of a NetCDF-3 file."""
    from scipy.io import netcdf_file

    # Mapped, so that only what is chosen is read.
    with (
        errors_of(path, "SciPy says '{}'", "scipy"),
        netcdf_file(path, "r", mmap=True, maskandscale=False) as file,
    ):
        arrays = [_array(file, name, v) for name, v in file.variables.items()]
        grid = grid_of_arrays(path, arrays, choice, "NetCDF-3")
        del arrays
        return grid


def _array(file: Any, name: str, variable: Any) -> StoredArray:
    scales = [(axis, file.variables.get(axis)) for axis in variable.dimensions]
    axes = [
        (axis, np.array(scale[:]), attribute_text(scale._attributes, "units"))
        if scale is not None and len(scale.shape) == 1
        else (axis, None, "")
        for axis, scale in scales
    ]
    place = placed(axes) if len(axes) > 2 else {}
    data = variable.data
    return StoredArray(
        name,
        tuple(int(n) for n in variable.shape),
        np.dtype(data.dtype),
        # A copy: the file is closed when it is used.
        lambda index: np.array(data[index], np.dtype(data.dtype).newbyteorder("=")),
        tuple(variable.dimensions),
        **place,
        **described(variable._attributes),
    )
