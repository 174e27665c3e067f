"""HDF5 and NetCDF files: opened by h5py and SciPy; what their numbers mean is CF's, by xarray."""

from __future__ import annotations

from functools import partial
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from model.errors import VolumeError, first_line
from model.volume_files.arrays import StoredArray, grid_of_arrays
from model.volume_files.checks import damaged, errors_of, not_a, truncated, unsupported
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.conventions import attribute_numbers, attribute_text
from model.volume_files.foreign import HDF5_SIGNATURE, foreign_advice
from model.volume_files.grid import Grid
from model.volume_files.hdf5_layouts import arrays_by_program, check_kind, values_of

if TYPE_CHECKING:
    import h5py

SUFFIXES = (".h5", ".hdf5", ".hdf", ".he5", ".ims", ".vtkhdf", ".mat", ".nc", ".nc4", ".cdf")
SIGNATURE_PLACES = (0, 512, 1024, 2048)
HEAP, MOST_SEARCHED = b"GCOL\1", 1 << 26  # how a heap begins, and where heaps are looked for

MOST_ARRAYS, LONGEST_AXIS = 5000, 1 << 20


def read_hdf5(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read an array of an HDF5 or NetCDF file."""
    with path.open("rb") as file:
        start = file.read(SIGNATURE_PLACES[-1] + 8)
    if start[:4] in (b"CDF\x01", b"CDF\x02"):
        return _read_netcdf3(path, choice)
    if not any(start[place : place + 8] == HDF5_SIGNATURE for place in SIGNATURE_PLACES):
        if advice := foreign_advice(path):
            raise VolumeError(f"{path}: {advice}.")
        raise not_a(path, "an HDF5 or NetCDF file")
    _check_heaps(path)
    import h5py

    try:
        with errors_of(path, "h5py says '{}'"), h5py.File(path, "r", locking=False) as file:
            check_kind(path, file)
            named = path.suffix.lower() in (".nc", ".nc4", ".cdf")
            is_netcdf = named or "_NCProperties" in file.attrs
            arrays = _arrays(path, file, is_netcdf)
            return grid_of_arrays(path, arrays, choice, "NetCDF-4" if is_netcdf else "HDF5")
    except OSError as error:
        raise _refusal(path, error) from None


def _check_heaps(path: Path) -> None:
    """Refuse a heap of texts with an entry of no length, at which HDF5 loops without end."""
    with path.open("rb") as file, mmap(file.fileno(), 0, access=ACCESS_READ) as data:
        start = data.find(HEAP, 0, MOST_SEARCHED)
        while start >= 0:
            size = int.from_bytes(data[start + 8 : start + 16], "little")
            at, end = start + 16, min(start + size, len(data)) - 16
            while at <= end:
                number, length = data[at : at + 2], int.from_bytes(data[at + 8 : at + 16], "little")
                if number == b"\0\0" and length == 0:
                    raise damaged(path, "a text in it has no length")
                at += length if number == b"\0\0" else 16 + -(-length // 8) * 8
            start = data.find(HEAP, start + 16, MOST_SEARCHED)


def _refusal(path: Path, error: OSError) -> VolumeError:
    said = first_line(error)
    if "truncated file" in said:
        return truncated(path, "it is shorter than its head says")
    if "filter" in said or "plugin" in said:
        return unsupported(
            path, "an HDF5 array of this compression", "rewrite it with h5repack -f GZIP=4"
        )
    return damaged(path, f"HDF5 says '{said}'")


def _arrays(path: Path, file: h5py.File, is_netcdf: bool) -> list[StoredArray]:
    """List the arrays, as the program that wrote the file means them or as they are."""
    import h5py

    found: dict[str, h5py.Dataset] = {}
    left_out: list[str] = []

    def note_links(name: str, group: h5py.Group) -> None:
        for key in [*group][:MOST_ARRAYS]:
            if isinstance(group.get(key, getlink=True), h5py.ExternalLink):
                left_out.append(f"{name}/{key} (a link to another file)".lstrip("/"))

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Group):
            note_links(name, item)
        if not isinstance(item, h5py.Dataset) or item.shape is None or len(found) > MOST_ARRAYS:
            return
        if item.is_virtual or item.external:
            left_out.append(f"{name} (its values lie in other files)")
        elif item.dtype.kind not in "biufc":
            left_out.append(f"{name} ({'records' if item.dtype.fields else 'no numbers'})")
        elif item.ndim >= 3 or (item.ndim and item.size > 1):
            found[name] = item

    note_links("", file)
    file.visititems(visit)
    if left_out and not found:
        raise VolumeError(
            f"{path}: it holds no array of numbers of its own, only {', '.join(left_out[:6])}"
            f"{' and more' if len(left_out) > 6 else ''}; save the numbers as one array in "
            "one file."
        )
    if arrays := arrays_by_program(path, file, found):
        return arrays
    return [_array(name, item, is_netcdf) for name, item in found.items()]


def _array(name: str, item: h5py.Dataset, is_netcdf: bool) -> StoredArray:
    """Describe an array by its dimension scales and by attributes in use."""
    letters = attribute_text(item.attrs, "axes") or attribute_text(item.attrs, "DimensionOrder")
    names = [*letters] if len(letters) == item.ndim else [""] * item.ndim
    coordinates = {}
    for k, (dimension, count) in enumerate(zip(item.dims, item.shape, strict=True)):
        names[k] = str(dimension.label or "") or names[k]
        scale = dimension[0] if len(dimension) else None
        if scale is None:
            continue
        names[k] = str(scale.name).rpartition("/")[2] or names[k]
        is_own = not (scale.is_virtual or scale.external)
        is_usable = scale.shape == (count,) and scale.dtype.kind in "iuf"
        if is_own and is_usable and 1 < count < LONGEST_AXIS:
            coordinates[names[k]] = scale[:], {**_plain(scale.attrs)}
    facts: dict[str, Any] = {}
    for size, unit in (("element_size_um", "um"), ("spacing", ""), ("voxel_size", "")):
        sizes = attribute_numbers(item.attrs, size)
        if len(sizes) == 3 and all(size > 0 for size in sizes) and not coordinates:
            unit = unit or attribute_text(item.attrs, "unit")
            facts = {"spacing": (sizes[2], sizes[1], sizes[0]), "unit": unit}
            break
    return StoredArray(
        name,
        tuple(int(n) for n in item.shape),
        item.dtype,
        partial(values_of, item),
        tuple(names),
        _plain(item.attrs),
        coordinates,
        is_netcdf=is_netcdf,
        **facts,
    )


def _plain(attributes: Any) -> dict[str, Any]:
    """Return the attributes that can be read."""
    found = {}
    for name in attributes:
        try:
            found[name] = attributes[name]
        except Exception:
            # Of types that h5py does not know.
            continue
    return found


def _read_netcdf3(path: Path, choice: Choice) -> Grid:
    from scipy.io import netcdf_file

    # Mapped, so that only what is chosen is read.
    with (
        errors_of(path, "SciPy says '{}'", "scipy"),
        netcdf_file(path, "r", mmap=True, maskandscale=False) as file,
    ):
        arrays = [_variable(file, name, v) for name, v in file.variables.items()]
        grid = grid_of_arrays(path, arrays, choice, "NetCDF-3")
        del arrays
        return grid


def _variable(file: Any, name: str, variable: Any) -> StoredArray:
    data = variable.data
    native = np.dtype(data.dtype).newbyteorder("=")
    scales = {axis: file.variables.get(axis) for axis in variable.dimensions}
    return StoredArray(
        name,
        tuple(int(n) for n in variable.shape),
        native,
        # A copy: the file is closed when it is used.
        lambda index: np.array(data[index], native),
        tuple(variable.dimensions),
        {**variable._attributes},
        {
            axis: (np.array(scale[:], scale.data.dtype.newbyteorder("=")), {**scale._attributes})
            for axis, scale in scales.items()
            if scale is not None and len(scale.shape) == 1 and 1 < scale.shape[0] < LONGEST_AXIS
        }
        if len(variable.shape) > 2
        else {},
        is_netcdf=True,
    )
