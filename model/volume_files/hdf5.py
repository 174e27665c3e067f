"""HDF5 files and NetCDF-4, which are HDF5, read by h5py."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from model.errors import VolumeError, first_line
from model.volume_files.arrays import (
    StoredArray,
    attribute_numbers,
    attribute_text,
    grid_of_arrays,
)
from model.volume_files.cf import described, placed
from model.volume_files.checks import damaged, truncated, unsupported
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.grid import Grid
from model.volume_files.library_log import errors_of

if TYPE_CHECKING:
    import h5py

SUFFIXES = (".h5", ".hdf5", ".hdf", ".he5", ".ims", ".vtkhdf", ".nc", ".nc4", ".cdf")
SIGNATURE = b"\x89HDF\r\n\x1a\n"
GREATEST_RATIO = 1100
"""Largest ratio of values to their bytes in the file: that of deflate, with some room."""

MOST_ARRAYS = 5000


def read_hdf5(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read an array of an HDF5 or NetCDF file."""
    with path.open("rb") as file:
        start = file.read(8)
    if start[:3] == b"CDF":
        from model.volume_files.netcdf3 import read_netcdf3

        return read_netcdf3(path, choice)
    if start != SIGNATURE:
        raise VolumeError(
            f"{path}: this is neither an HDF5 nor a NetCDF file; choose another or correct its "
            "suffix."
        )
    import h5py

    try:
        with errors_of(path, "h5py says '{}'"), h5py.File(path, "r", locking=False) as file:
            return grid_of_arrays(path, _arrays(path, file), choice, _format(path, file))
    except OSError as error:
        raise _refusal(path, error) from None


def _format(path: Path, file: h5py.File) -> str:
    is_netcdf = path.suffix.lower() in (".nc", ".nc4", ".cdf") or "_NCProperties" in file.attrs
    return "NetCDF-4" if is_netcdf else "HDF5"


def _refusal(path: Path, error: OSError) -> VolumeError:
    said = first_line(error)
    if "truncated file" in said:
        return truncated(path, "it is shorter than its head says")
    if "filter" in said or "plugin" in said:
        return unsupported(
            path, "an HDF5 array of this compression", "rewrite it with h5repack -f GZIP=4"
        )
    return damaged(path, f"HDF5 says '{said}'")


def _arrays(path: Path, file: h5py.File) -> list[StoredArray]:
    import h5py

    found: list[StoredArray] = []
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
            found.append(_array(path, file, name, item))

    note_links("", file)
    file.visititems(visit)
    if left_out and not found:
        raise VolumeError(
            f"{path}: it holds no array of numbers of its own, only {', '.join(left_out[:6])}"
            f"{' and more' if len(left_out) > 6 else ''}; save the numbers as one array in "
            "one file."
        )
    return found


def _array(path: Path, file: h5py.File, name: str, item: h5py.Dataset) -> StoredArray:
    def read(index: Any) -> np.ndarray[Any, Any]:
        stored = item.id.get_storage_size()
        ratio = GREATEST_RATIO if item.compression or item.chunks else 1
        if stored * ratio < item.size * item.dtype.itemsize:
            raise damaged(
                path, f"its array '{name}' has {stored} bytes, which cannot hold its values"
            )
        return item[index]

    attributes: Mapping[str, Any] = item.attrs
    place = _axes(item) if item.ndim > 2 else {}
    if not any(place.get("steps", ())):
        place |= _sizes(file, item)
    return StoredArray(
        name,
        tuple(int(n) for n in item.shape),
        item.dtype,
        read,
        **place,
        **described(attributes),
    )


def _axes(item: h5py.Dataset) -> dict[str, Any]:
    """Return names, steps, units and starts of an array's axes, by its dimension scales."""
    letters = attribute_text(item.attrs, "axes") or attribute_text(item.attrs, "DimensionOrder")
    labels = [*letters] if len(letters) == item.ndim else [""] * item.ndim
    axes = []
    for label, dimension, count in zip(labels, item.dims, item.shape, strict=True):
        scale = dimension[0] if len(dimension) else None
        name = str(dimension.label or "")
        if scale is None:
            axes.append((name or label, None, ""))
            continue
        name = name or str(scale.name).rpartition("/")[2] or label
        is_usable = scale.shape == (count,) and scale.dtype.kind in "iuf" and count < 1 << 20
        unit = attribute_text(scale.attrs, "units")
        axes.append((name, scale[:] if is_usable else None, unit))
    return {"axes": tuple(name for name, _, _ in axes), **placed(axes)}


def _sizes(file: h5py.File, item: h5py.Dataset) -> dict[str, Any]:
    """Return steps, units and starts of the last three axes, by attributes in use."""
    nothing: tuple[float, ...] = (0.0,) * (item.ndim - 3)
    attributes = item.attrs
    for name, unit in (("element_size_um", "um"), ("spacing", ""), ("voxel_size", "")):
        sizes = attribute_numbers(attributes, name)
        if len(sizes) == 3 and all(size > 0 for size in sizes):
            unit = unit or attribute_text(attributes, "unit")
            return _along((*(None for _ in nothing), *sizes), unit)
    group = file.get("VTKHDF")
    if group is not None and item.name.startswith("/VTKHDF/"):
        sizes, origin = (attribute_numbers(group.attrs, name) for name in ("Spacing", "Origin"))
        if len(sizes) == 3:
            origin = origin if len(origin) == 3 else [0.0] * 3
            steps = (*(None for _ in nothing), *sizes[::-1])
            return _along(steps, "", (*nothing, *origin[::-1]))
    image = file.get("DataSetInfo/Image")
    if image is not None and item.name.startswith("/DataSet/"):
        return _imaris_sizes(image.attrs, item)
    return _along((), "")


def _along(
    steps: tuple[float | None, ...], unit: str, starts: tuple[float, ...] = ()
) -> dict[str, Any]:
    return {"steps": steps, "units_of_steps": (unit,) * len(steps), "starts": starts}


def _imaris_sizes(attributes: Mapping[str, Any], item: h5py.Dataset) -> dict[str, Any]:
    """Return the steps of an Imaris file, whose attributes are arrays of letters."""

    def number(name: str) -> float | None:
        try:
            return float(b"".join(np.ravel(attributes[name]).tolist()))
        except (KeyError, TypeError, ValueError):
            return None

    steps = []
    for axis, size in zip("210", item.shape[-3:], strict=True):
        low, high = number(f"ExtMin{axis}"), number(f"ExtMax{axis}")
        steps.append(None if low is None or high is None else (high - low) / size)
    return _along(tuple(steps), "um")
