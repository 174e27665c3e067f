"""Zarr arrays and groups, and OME-Zarr, which are folders, read by zarr."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from model.errors import VolumeError, first_line
from model.json_files import parse_json
from model.volume_files.arrays import StoredArray, grid_of_arrays
from model.volume_files.checks import damaged, errors_of
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.conventions import Coordinates
from model.volume_files.grid import Grid, in_one_unit
from model.volume_files.label_names import ome_labels

GREATEST_RATIO = 1 << 14
MOST_CHUNK = 1 << 31
MOST_UNWRITTEN = 1 << 28  # bytes of voxels that are plausible without any chunks
DEEPEST, MOST_ARRAYS, LONGEST_AXIS = 6, 500, 1 << 20  # limits of folders, arrays and positions

HEADS = ("zarr.json", ".zarray", ".zgroup")


def is_zarr(folder: Path) -> bool:
    """Return True for a folder that is a Zarr array or group."""
    return any((folder / name).is_file() for name in HEADS)


def read_zarr(folder: Path, choice: Choice = LARGEST) -> Grid:
    """Read an array of a Zarr folder; the finest of OME-Zarr's levels."""
    with errors_of(folder, "zarr says '{}'", "zarr"):
        levels: dict[Path, _Level] = {}
        places = [*_places(folder, levels)]
        arrays = [_array(folder, place, levels.get(place, {})) for place in places]
        return grid_of_arrays(folder, arrays, choice, "Zarr")


_Level = dict[str, Any]  # OME's facts of an array, by names of :class:`StoredArray`


def _places(folder: Path, levels: dict[Path, _Level], depth: int = 0) -> Iterator[Path]:
    """Yield the folders of arrays, and collect their groups' metadata."""
    own = folder.resolve()
    if (folder / ".zarray").is_file() or _json(folder / "zarr.json").get("node_type") == "array":
        yield folder
        return
    levels |= _ome_levels(folder)
    if depth == DEEPEST:
        return
    for number, path in enumerate(sorted(p for p in folder.iterdir() if p.is_dir())):
        if number >= MOST_ARRAYS or not path.resolve().is_relative_to(own):
            continue
        if is_zarr(path):
            yield from _places(path, levels, depth + 1)


def _json(path: Path) -> dict[str, Any]:
    if not path.is_file() or path.stat().st_size > 1 << 24:
        return {}
    try:
        found = parse_json(path.read_bytes())
    except ValueError as error:
        raise damaged(path, first_line(error)) from None
    return found if isinstance(found, dict) else {}


def _array(folder: Path, place: Path, level: _Level) -> StoredArray:
    import zarr

    item = zarr.open_array(store=str(place), mode="r")
    name = place.relative_to(folder).as_posix() if place != folder else folder.stem
    attributes: dict[str, Any] = dict(item.attrs)
    axes: tuple[str, ...] = level.get("axes", ())
    coordinates: Coordinates = {}
    if not axes:
        named = attributes.get("_ARRAY_DIMENSIONS") or getattr(item.metadata, "dimension_names", ())
        axes = tuple(str(each or "") for each in named or ())
        if len(axes) == item.ndim > 2:
            coordinates = _coordinates(place.parent, axes, item.shape)
        if "_ARRAY_DIMENSIONS" in attributes and item.fill_value is not None:
            # Where xarray keeps it in version 2.
            attributes.setdefault("_FillValue", item.fill_value)
        elif isinstance(attributes.get("_FillValue"), str):
            from xarray.backends.zarr import FillValueCoder

            attributes["_FillValue"] = FillValueCoder.decode(attributes["_FillValue"], item.dtype)

    def read(index: Any) -> np.ndarray[Any, Any]:
        _check_chunks(place, item)
        return np.asarray(item[index])

    return StoredArray(
        name,
        item.shape,
        item.dtype,
        read,
        attributes=attributes,
        coordinates=coordinates,
        **{"axes": axes, **level},
    )


def _coordinates(group: Path, axes: tuple[str, ...], shape: tuple[int, ...]) -> Coordinates:
    """Return the arrays that are named like axes, as xarray stores coordinates."""
    import zarr

    found = {}
    for name, count in zip(axes, shape, strict=True):
        place = group / name
        if not name or place.parent != group or not is_zarr(place) or not 1 < count < LONGEST_AXIS:
            continue
        if not place.resolve().is_relative_to(group.resolve()):
            continue
        item = zarr.open_array(store=str(place), mode="r")
        if item.shape == (count,) and np.dtype(item.dtype).kind in "iuf":
            _check_chunks(place, item)
            found[name] = np.asarray(item[:]), dict(item.attrs)
    return found


def _ome_levels(group: Path) -> dict[Path, _Level]:
    """Return a group's OME metadata for the arrays below it."""
    data = _json(group / "zarr.json").get("attributes", {}) or _json(group / ".zattrs")
    data = data.get("ome", data) if isinstance(data, dict) else {}
    found = {}
    try:
        channels = tuple(str(c.get("label", "")) for c in data["omero"]["channels"])
    except (TypeError, KeyError, AttributeError):
        channels = ()
    try:
        labels = ome_labels(data)
        first = data["multiscales"][0]
        axes = [axis if isinstance(axis, dict) else {"name": axis} for axis in first["axes"]]
        names = tuple(str(axis["name"]) for axis in axes)
        units = [str(axis.get("unit", "")) for axis in axes]
        for dataset in first["datasets"]:
            transforms = [
                *dataset.get("coordinateTransformations", []),
                *first.get("coordinateTransformations", []),
            ]
            has_scale, steps, start = False, np.ones(len(names)), np.zeros(len(names))
            for transform in transforms:
                if "scale" in transform:
                    scale = np.array(transform["scale"], float)
                    has_scale, steps, start = True, steps * scale, start * scale
                elif "translation" in transform:
                    start = start + np.array(transform["translation"], float)
            if len(steps) != len(names) or len(start) != len(names):
                continue
            place = [names.index(letter) if letter in names else None for letter in "xyz"]
            sizes = [None if k is None or not has_scale else float(steps[k]) for k in place]
            own = ["" if k is None else units[k] for k in place]
            lengths, unit, notes = in_one_unit(sizes, own)
            x, y, z = (
                0.0 if k is None or not size or not length else float(start[k] * length / size)
                for k, size, length in zip(place, sizes, lengths, strict=True)
            )
            found[group / str(dataset["path"])] = {
                **{"axes": names, "unit": unit, "origin": (x, y, z), "notes": notes},
                "spacing": (lengths[0], lengths[1], lengths[2]) if any(lengths) else None,
                **{"channels": channels, "is_labels": "image-label" in data, "labels": labels},
            }
    except (TypeError, KeyError, IndexError, ValueError, AttributeError):
        return found
    return found


def _check_chunks(place: Path, item: Any) -> None:
    """Check that the chunks can hold the voxels before memory is allocated."""
    own = place.resolve()
    each = math.prod(int(n) for n in item.chunks) * np.dtype(item.dtype).itemsize
    if not 0 < each <= MOST_CHUNK:
        raise damaged(place, f"its chunks have {each} bytes")
    # Blosc trusts the size in a chunk's header, even beyond its end. A shard holds many chunks.
    is_blosc = "blosc" in str(item.compressors).lower() and item.shards is None
    present, count = 0, 0
    for path in place.rglob("*"):
        if path.is_symlink() and not path.resolve().is_relative_to(own):
            raise VolumeError(
                f"{path}: it is a link that leads out of its folder, from which nothing is read; "
                "put the files themselves here."
            )
        if path.is_file() and path.name not in (*HEADS, ".zattrs", ".zmetadata"):
            size = path.stat().st_size
            present, count = present + size, count + 1
            with path.open("rb") as file:
                head = file.read(16)
            if is_blosc and int.from_bytes(head[12:], "little") != size:
                raise damaged(path, "it is not as long as its Blosc header says")
    if not count:
        raise damaged(place, "all of its chunks are missing")
    # Missing chunks have the fill value.
    need = math.prod(item.shape) * np.dtype(item.dtype).itemsize
    if need > max(present * GREATEST_RATIO, MOST_UNWRITTEN):
        raise damaged(place, "its chunks are too few for its voxels")
