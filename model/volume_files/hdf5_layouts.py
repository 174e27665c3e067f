"""Layouts of volumes in HDF5: Imaris, BigDataViewer, ilastik, ITK, openPMD, VTK, MATLAB."""

from __future__ import annotations

import json
import math
import re
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from model.volume_files.arrays import StoredArray
from model.volume_files.checks import damaged, unsupported
from model.volume_files.conventions import attribute_number, attribute_numbers, attribute_text
from model.volume_files.grid import unit_name
from model.volume_files.vtk_images import VtkArray, image_arrays

if TYPE_CHECKING:
    import h5py

Items = dict[str, Any]  # h5py.Dataset by name

_VTK_KINDS = {
    "OverlappingAMR": "an adaptive grid",
    "UnstructuredGrid": "an unstructured grid",
    "RectilinearGrid": "a rectilinear grid",
    "PolyData": "a surface",
}
LONGEST_XML = 1 << 22
GREATEST_RATIO = 1100  # of values to their bytes in the file: that of deflate, with some room
MOST_UNWRITTEN = 1 << 28  # bytes that are believed to be fill values, however few are written


def values_of(item: Any, index: Any) -> NDArray[Any]:
    """Read a part of an array whose bytes can hold its values; chunks may be unwritten."""
    stored, need = item.id.get_storage_size(), item.size * item.dtype.itemsize
    room = stored * (GREATEST_RATIO if item.chunks else 1)
    if item.chunks or not stored:
        # What was never written has the fill value.
        room = max(room, MOST_UNWRITTEN)
    if item.chunks and not (item.compression or item.shuffle):
        written = item.id.get_num_chunks() * math.prod(item.chunks) * item.dtype.itemsize
        room = stored if stored < min(written, need) else room
    if room < need:
        how = f"its array '{item.name}' has {stored} bytes, which cannot hold its values"
        raise damaged(Path(item.file.filename), how)
    values: NDArray[Any] = item[index]
    return values


def check_kind(path: Path, file: h5py.File) -> None:
    """Refuse files whose arrays are no volumes by themselves, by what they are."""
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
    """Return a group of the file; None if it is missing or a link, perhaps to another file."""
    import h5py

    place: Any = file
    for part in name.split("/"):
        is_group = isinstance(place, h5py.Group)
        if not is_group or not isinstance(place.get(part, getlink=True), h5py.HardLink):
            return None
        place = place[part]
    return place


def arrays_by_program(path: Path, file: h5py.File, items: Items) -> list[StoredArray]:
    """Return the arrays of a file as the program that wrote it means them; none if not known."""
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
    shape = tuple(int(n) for n in item.shape)
    return StoredArray(name, shape, item.dtype, partial(values_of, item), axes, **facts)


def _parts(
    parts: dict[tuple[int, int], Any], name: str, sizes: tuple[int, ...], **facts: Any
) -> StoredArray:
    """Join volumes by their number in time and channel, each cut to sizes along z, y and x."""
    times, channels = (sorted({key[k] for key in parts}) for k in (0, 1))
    inner = tuple(slice(0, n) for n in sizes)
    dtype = next(iter(parts.values())).dtype

    def read(index: Any) -> NDArray[Any]:
        time, channel = (each if isinstance(each, int) else 0 for each in index[:2])
        values = values_of(parts[times[time], channels[channel]], inner)
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
        [_text_number(image.attrs, f"Ext{end}{axis}") for axis in "012"] for end in ("Min", "Max")
    )
    unit = unit_name(attribute_text(image.attrs, "Unit") or "um")
    arrays = []
    for level, parts in levels.items():
        first = next(iter(parts.values()))
        given = [_text_number(first.parent.attrs, f"ImageSize{axis}") for axis in "XYZ"]
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


def _text_number(attributes: Any, name: str) -> float | None:
    """Return a number that is stored as text; None if it is missing."""
    try:
        return float(attribute_text(attributes, name))
    except ValueError:
        return None


def _big_data_viewer(path: Path, items: Items) -> list[StoredArray]:
    """Signed numbers are meant as unsigned ones; sizes are in the file's .xml."""
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
            array = replace(array, dtype=np.dtype(np.uint16), read=partial(_unsigned, array.read))
        found.append(array)
    return found


def _unsigned(read: Callable[..., NDArray[Any]], index: Any) -> NDArray[Any]:
    return read(index).view(np.uint16)


def _setup_sizes(path: Path) -> dict[int, tuple[list[float], str]]:
    """Return voxel sizes and their unit by number of the view, where the file's .xml is there."""
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
        # What a vector's components share is said of their group.
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
            read = partial(values_of, item)
            found.append(VtkArray(its_name, kind[1] == "Cell", item.shape, item.dtype, read))
    return image_arrays(
        found,
        extent[::2] if len(extent) == 6 else [0.0] * 3,
        spacing if len(spacing) == 3 else None,
        origin if len(origin) == 3 else [0.0] * 3,
        # Column k of the matrix is the direction of axis k.
        np.array(direction).reshape(3, 3).T if len(direction) == 9 else np.eye(3),
    )
