"""HDF5 and NetCDF files, opened by h5py and SciPy, in CF's way or that of their programs."""

from __future__ import annotations

import json
import math
import re
from collections import defaultdict
from dataclasses import replace
from functools import partial
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError, first_line
from model.volume_files.arrays import StoredArray, grid_of_arrays
from model.volume_files.checks import damaged, errors_of, not_a, number_of, truncated, unsupported
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.conventions import attribute_number, attribute_numbers, attribute_text
from model.volume_files.foreign import foreign_advice
from model.volume_files.grid import Grid, unit_name
from model.volume_files.vtk_images import VtkArray, image_arrays

if TYPE_CHECKING:
    import h5py

SIGNATURE = b"\x89HDF\r\n\x1a\n"
SIGNATURE_PLACES = (0, 512, 1024, 2048)
HEAP, MOST_SEARCHED = b"GCOL\1", 1 << 26  # first bytes of a heap, and where heaps are searched for

MOST_ARRAYS, LONGEST_AXIS = 5000, 1 << 20


def read_hdf5(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read an array of an HDF5 or NetCDF file."""
    with path.open("rb") as file:
        start = file.read(SIGNATURE_PLACES[-1] + 8)
    if start[:4] in (b"CDF\x01", b"CDF\x02"):
        return _read_netcdf3(path, choice)
    if not any(start[place : place + 8] == SIGNATURE for place in SIGNATURE_PLACES):
        if advice := foreign_advice(path):
            raise VolumeError(f"{path}: {advice}.")
        raise not_a(path, "an HDF5 or NetCDF file")
    _check_heaps(path)
    import h5py

    try:
        with errors_of(path, "h5py says '{}'"), h5py.File(path, "r", locking=False) as file:
            _check_kind(path, file)
            named = path.suffix.lower() in (".nc", ".nc4", ".cdf")
            is_netcdf = named or "_NCProperties" in file.attrs
            arrays = _arrays(path, file, is_netcdf)
            return grid_of_arrays(path, arrays, choice, "NetCDF-4" if is_netcdf else "HDF5")
    except OSError as error:
        raise _refusal(path, error) from None


def _check_heaps(path: Path) -> None:
    """Refuse a heap of texts with an entry of length 0, at which HDF5 loops forever."""
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
        return truncated(path, "it is shorter than its header says")
    if "filter" in said or "plugin" in said:
        return unsupported(
            path, "an HDF5 array of this compression", "rewrite it with h5repack -f GZIP=4"
        )
    return damaged(path, f"HDF5 says '{said}'")


def _arrays(path: Path, file: h5py.File, is_netcdf: bool) -> list[StoredArray]:
    """List the arrays as the writing program means them, or as they are."""
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
    if arrays := _arrays_by_program(path, file, found):
        return arrays
    return [_array(name, item, is_netcdf) for name, item in found.items()]


def _array(name: str, item: h5py.Dataset, is_netcdf: bool) -> StoredArray:
    """Describe an array by its dimension scales and common attributes."""
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
            coordinates[names[k]] = scale[:], scale.attrs
    facts: dict[str, Any] = {}
    for size, unit in (("element_size_um", "um"), ("spacing", ""), ("voxel_size", "")):
        sizes = attribute_numbers(item.attrs, size)
        if len(sizes) == 3 and all(size > 0 for size in sizes) and not coordinates:
            unit = unit or attribute_text(item.attrs, "unit")
            facts = {"spacing": (sizes[2], sizes[1], sizes[0]), "unit": unit}
            break
    facts |= {"attributes": item.attrs, "coordinates": coordinates, "is_netcdf": is_netcdf}
    return _stored(name, item, tuple(names), **facts)


def _read_netcdf3(path: Path, choice: Choice) -> Grid:
    from scipy.io import netcdf_file

    # Memory-mapped, so that only the chosen part is read.
    with (
        errors_of(path, "SciPy says '{}'", "scipy"),
        netcdf_file(path, "r", mmap=True, maskandscale=False) as file,
    ):
        arrays = [_variable(file, name, v) for name, v in file.variables.items()]
        grid = grid_of_arrays(path, arrays, choice, "NetCDF-3")
        del arrays
        return grid


def _variable(file: Any, name: str, variable: Any) -> StoredArray:
    coordinates = {}
    for axis in variable.dimensions if len(variable.shape) > 2 else ():
        scale = file.variables.get(axis)
        if scale is not None and len(scale.shape) == 1 and 1 < scale.shape[0] < LONGEST_AXIS:
            coordinates[axis] = _native(scale.data, slice(None)), {**scale._attributes}
    return StoredArray(
        name,
        variable.shape,
        variable.data.dtype.newbyteorder("="),
        partial(_native, variable.data),
        variable.dimensions,
        {**variable._attributes},
        coordinates,
        is_netcdf=True,
    )


def _native(data: NDArray[Any], index: Any) -> NDArray[Any]:
    """Copy a part of an array, as the file is closed before its use."""
    return np.array(data[index], data.dtype.newbyteorder("="))


# --- layouts of programs -------------------------------------------------------------------

Items = dict[str, Any]  # h5py.Dataset by name

_VTK_KINDS = {
    "OverlappingAMR": "an adaptive grid", "UnstructuredGrid": "an unstructured grid",
    "RectilinearGrid": "a rectilinear grid", "PolyData": "a surface",
}  # fmt: skip
LONGEST_XML = 1 << 22
GREATEST_RATIO = 1100  # of values to their bytes in the file: that of deflate, with some room
MOST_UNWRITTEN = 1 << 28  # bytes that may always be fill values, however few are written


def _values_of(item: Any, index: Any) -> NDArray[Any]:
    """Read a part of an array whose bytes can hold its values; chunks may be unwritten."""
    stored, need = item.id.get_storage_size(), item.size * item.dtype.itemsize
    room = stored * (GREATEST_RATIO if item.chunks else 1)
    if item.chunks or not stored:
        # Unwritten voxels have the fill value.
        room = max(room, MOST_UNWRITTEN)
    if item.chunks and not (item.compression or item.shuffle):
        written = item.id.get_num_chunks() * math.prod(item.chunks) * item.dtype.itemsize
        room = stored if stored < min(written, need) else room
    if room < need:
        how = f"its array '{item.name}' has {stored} bytes, which cannot hold its values"
        raise damaged(Path(item.file.filename), how)
    values: NDArray[Any] = item[index]
    return values


def _check_kind(path: Path, file: h5py.File) -> None:
    """Refuse files of kinds whose arrays are no volumes by themselves."""
    paraview = "resample it to an image in ParaView (Resample To Image), and save that as .vti"
    keys = {*file}
    is_adaptive = {"refine level", "node type"} <= keys or "Chombo_global" in keys
    if is_adaptive or "Grid00000001" in keys:
        raise unsupported(path, "an adaptive grid, of blocks of different resolution,", paraview)
    group = _own(file, "VTKHDF")
    kind = "ImageData" if group is None else attribute_text(group.attrs, "Type")
    if kind != "ImageData":
        what = _VTK_KINDS.get(kind, f"VTK's {kind[:40]}")
        raise unsupported(path, f"{what} in VTKHDF", paraview)


def _own(file: h5py.File, name: str) -> Any:
    """Return a group of the file; None if it is missing or a link."""
    import h5py

    place: Any = file
    for part in name.split("/"):
        is_group = isinstance(place, h5py.Group)
        if not is_group or not isinstance(place.get(part, getlink=True), h5py.HardLink):
            return None
        place = place[part]
    return place


def _arrays_by_program(path: Path, file: h5py.File, items: Items) -> list[StoredArray]:
    """Return the arrays of a file as its program means them; none if unknown."""
    if (image := _own(file, "DataSetInfo/Image")) is not None:
        return _imaris(file, image, items)
    if any(re.fullmatch(r"t\d{5,}/s\d{2,}/\d+/cells", name) for name in items):
        return _big_data_viewer(path, items)
    if "ITKImage" in file:
        return _itk(items)
    if (group := _own(file, "VTKHDF")) is not None:
        return _vtk(group, items)
    if "openPMD" in file.attrs:
        return _open_pmd(path, items)
    if any("axistags" in item.attrs for item in items.values()):
        return [_ilastik(name, item) for name, item in items.items()]
    if any("MATLAB_class" in item.attrs for item in items.values()):
        # MATLAB's rows, columns and slices are y, x and z; HDF5 has them the other way round.
        axes = {3: ("z", "x", "y"), 4: ("t", "z", "x", "y")}
        return [_stored(name, item, axes.get(item.ndim, ())) for name, item in items.items()]
    return []


def _stored(name: str, item: Any, axes: tuple[str, ...] = (), **facts: Any) -> StoredArray:
    return StoredArray(name, item.shape, item.dtype, partial(_values_of, item), axes, **facts)


def _parts(
    parts: dict[tuple[int, int], Any], name: str, sizes: tuple[int, ...], **facts: Any
) -> StoredArray:
    """Join volumes by their number in time and channel, each cut to sizes along z, y and x."""
    times, channels = (sorted({key[k] for key in parts}) for k in (0, 1))
    inner = tuple(slice(0, n) for n in sizes)
    dtype = next(iter(parts.values())).dtype

    def read(index: Any) -> NDArray[Any]:
        time, channel = (each if isinstance(each, int) else 0 for each in index[:2])
        values = _values_of(parts[times[time], channels[channel]], inner)
        for axis in (1, 0):
            if not isinstance(index[axis], int):
                values = values[None]
        return values

    shape = (len(times), len(channels), *sizes)
    if set(parts) != {(t, c) for t in times for c in channels}:
        raise KeyError(f"some time steps of '{name}' lack channels")
    return StoredArray(name, shape, dtype, read, ("t", "c", "z", "y", "x"), **facts)


def _imaris(file: h5py.File, image: Any, items: Items) -> list[StoredArray]:
    levels: dict[str, dict[tuple[int, int], Any]] = defaultdict(dict)
    for name, item in items.items():
        place = r"DataSet/(ResolutionLevel \d+)/TimePoint (\d+)/Channel (\d+)/Data"
        if found := re.fullmatch(place, name):
            levels[found[1]][int(found[2]), int(found[3])] = item
    lows, highs = (
        [number_of(attribute_text(image.attrs, f"Ext{end}{axis}")) for axis in "012"]
        for end in ("Min", "Max")
    )
    unit = unit_name(attribute_text(image.attrs, "Unit") or "um")
    arrays = []
    for level, parts in levels.items():
        first = next(iter(parts.values()))
        given = [
            number_of(attribute_text(first.parent.attrs, f"ImageSize{axis}")) for axis in "XYZ"
        ]
        # Blocks are padded beyond the image.
        sizes = [int(min(n or m, m)) for n, m in zip(given, first.shape[::-1], strict=True)]
        spacing = [
            None if low is None or high is None else (high - low) / n
            for low, high, n in zip(lows, highs, sizes, strict=True)
        ]
        origin = [(low or 0.0) + (s or 0.0) / 2 for low, s in zip(lows, spacing, strict=True)]
        about = [_own(file, f"DataSetInfo/Channel {k}") for k in sorted({key[1] for key in parts})]
        channels = ["" if group is None else attribute_text(group.attrs, "Name") for group in about]
        facts = {"spacing": tuple(spacing), "origin": tuple(origin), "channels": tuple(channels)}
        arrays.append(_parts(parts, level, tuple(sizes[::-1]), unit=unit, **facts))
    return arrays


def _big_data_viewer(path: Path, items: Items) -> list[StoredArray]:
    """Signed numbers stand for unsigned ones; sizes are in the file's .xml."""
    setups: dict[tuple[int, str], dict[tuple[int, int], Any]] = defaultdict(dict)
    for name, item in items.items():
        if place := re.fullmatch(r"t(\d+)/s(\d+)/(\d+)/cells", name):
            setups[int(place[3]), place[2]][int(place[1]), 0] = item
    found = []
    sizes = _setup_sizes(path.with_suffix(".xml"))
    for (level, setup), parts in sorted(setups.items()):
        factors = items.get(f"s{setup}/resolutions")
        factor = np.ones(3) if factors is None else np.asarray(factors[level], float)
        size, unit = sizes.get(int(setup), (None, ""))
        array = _parts(
            parts,
            f"s{setup}" + (f"/{level}" if level else ""),
            next(iter(parts.values())).shape,
            spacing=None if size is None else tuple((np.array(size) * factor).tolist()),
            unit=unit,
        )
        if array.dtype == np.int16:
            read = partial(lambda read, index: read(index).view(np.uint16), array.read)
            array = replace(array, dtype=np.dtype(np.uint16), read=read)
        found.append(array)
    return found


def _setup_sizes(path: Path) -> dict[int, tuple[list[float], str]]:
    """Return voxel sizes and units by view number, from the file's .xml if it exists."""
    is_own = path.resolve().parent == path.parent.resolve()
    if not is_own or not path.is_file() or path.stat().st_size > LONGEST_XML:
        return {}
    text = path.read_text("utf-8", "replace")
    found = {}
    try:
        root = ElementTree.fromstring(text if "<!ENTITY" not in text else "")
        for setup in root.iter("ViewSetup"):
            sizes = [float(word) for word in (setup.findtext("voxelSize/size") or "").split()]
            if len(sizes) == 3:
                unit = unit_name(setup.findtext("voxelSize/unit") or "")
                found[int(setup.findtext("id") or 0)] = sizes, unit
    except (ElementTree.ParseError, ValueError):
        return {}
    return found


def _ilastik(name: str, item: Any) -> StoredArray:
    try:
        tags = json.loads(attribute_text(item.attrs, "axistags"))["axes"]
        axes = tuple(str(tag["key"]) for tag in tags)
        steps = {str(tag["key"]): float(tag.get("resolution") or 0) or None for tag in tags}
    except (ValueError, TypeError, KeyError, AttributeError):
        return _stored(name, item)
    if len(axes) != item.ndim:
        return _stored(name, item)
    x, y, z = (steps.get(letter) for letter in "xyz")
    return _stored(name, item, axes, spacing=(x, y, z) if x or y or z else None)


def _itk(items: Items) -> list[StoredArray]:
    found = []
    for name, item in items.items():
        group, _, last = name.rpartition("/")
        if last != "VoxelData":
            continue
        names = ("Spacing", "Origin", "Directions")
        said = [items.get(f"{group}/{each}") for each in names]
        facts: dict[str, Any] = {}
        if all(each is not None for each in said):
            spacing, origin, directions = (np.asarray(each, float) for each in said)
            if spacing.shape == origin.shape == (3,) and directions.shape == (3, 3):
                place = {"spacing": tuple(spacing.tolist()), "origin": tuple(origin.tolist())}
                facts = {**place, "directions": directions}
        found.append(_stored(group, item, **facts))
    return found


def _open_pmd(path: Path, items: Items) -> list[StoredArray]:
    found = []
    for name, item in items.items():
        # Properties that a vector's components share are their group's.
        said = {**item.parent.attrs, **item.attrs}
        labels = [
            label.decode() if isinstance(label, bytes) else str(label)
            for label in np.ravel(said.get("axisLabels", []))
        ]
        if len(labels) != item.ndim:
            continue
        if attribute_text(said, "geometry") not in ("", "cartesian"):
            raise unsupported(
                path, f"openPMD's geometry '{attribute_text(said, 'geometry')[:40]}'",
                "resample it to a cartesian grid",
            )  # fmt: skip
        steps, offset = (
            attribute_numbers(said, key) for key in ("gridSpacing", "gridGlobalOffset")
        )
        axes = tuple(labels)
        if attribute_text(said, "dataOrder") == "F":
            axes, steps, offset = axes[::-1], steps[::-1], offset[::-1]
        metres, unit = attribute_number(said, "gridUnitSI") or 1.0, "m"
        for small, its_name in ((1e-12, "pm"), (1e-9, "nm"), (1e-6, "um"), (1e-3, "mm")):
            if abs(metres / small - 1) < 1e-6:
                metres, unit = 1.0, its_name
        at = dict(zip(axes, steps, strict=False))
        first = dict(zip(axes, offset, strict=False))
        x, y, z = (at[letter] * metres if letter in at else None for letter in "xyz")
        x0, y0, z0 = (first.get(letter, 0.0) * metres for letter in "xyz")
        found.append(_stored(name, item, axes, spacing=(x, y, z), origin=(x0, y0, z0), unit=unit))
    return found


def _vtk(group: Any, items: Items) -> list[StoredArray]:
    spacing, origin, extent, direction = (
        attribute_numbers(group.attrs, name)
        for name in ("Spacing", "Origin", "WholeExtent", "Direction")
    )
    found = []
    for name, item in items.items():
        kind = re.match(r"VTKHDF/(Cell|Point)Data/", name)
        if kind and item.ndim in (3, 4):
            its_name = name.rpartition("/")[2]
            read = partial(_values_of, item)
            found.append(VtkArray(its_name, kind[1] == "Cell", item.shape, item.dtype, read))
    return image_arrays(
        found,
        extent[::2] if len(extent) == 6 else [0.0] * 3,
        spacing if len(spacing) == 3 else None,
        origin if len(origin) == 3 else [0.0] * 3,
        # Column k of the matrix is the direction of axis k.
        np.array(direction).reshape(3, 3).T if len(direction) == 9 else np.eye(3),
    )
