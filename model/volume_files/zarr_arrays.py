"""Zarr arrays and groups, and OME-Zarr, which are folders, read by zarr."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from model.errors import VolumeError, first_line
from model.json_files import parse_json
from model.volume_files.arrays import StoredArray, grid_of_arrays
from model.volume_files.cf import described
from model.volume_files.checks import damaged
from model.volume_files.choice import LARGEST, Choice
from model.volume_files.grid import Grid
from model.volume_files.library_log import errors_of

SUFFIX = ".zarr"
GREATEST_RATIO = 1 << 14
MOST_CHUNK = 1 << 31
MOST_UNWRITTEN = 1 << 28
"""Bytes of voxels that are believed however few chunks there are."""

DEEPEST, MOST_ARRAYS = 6, 500
"""Folders below the one that is opened, and arrays, that are looked at."""

HEADS = ("zarr.json", ".zarray", ".zgroup")


def is_zarr(folder: Path) -> bool:
    """Return True for a folder that is a Zarr array or group."""
    return any((folder / name).is_file() for name in HEADS)


def read_zarr(folder: Path, choice: Choice = LARGEST) -> Grid:
    """Read an array of a Zarr folder that fits memory; of OME-Zarr's levels the finest."""
    with errors_of(folder, "zarr says '{}'", "zarr"):
        arrays = [_array(folder, place) for place in _places(folder)]
        return grid_of_arrays(folder, arrays, choice, "Zarr")


def _places(folder: Path, depth: int = 0) -> Iterator[Path]:
    """Yield the folders of arrays."""
    own = folder.resolve()
    if (folder / ".zarray").is_file() or _node_type(folder) == "array":
        yield folder
        return
    if depth == DEEPEST:
        return
    for number, path in enumerate(sorted(p for p in folder.iterdir() if p.is_dir())):
        if number >= MOST_ARRAYS or not path.resolve().is_relative_to(own):
            continue
        if is_zarr(path):
            yield from _places(path, depth + 1)


def _node_type(folder: Path) -> str:
    return str(_json(folder / "zarr.json").get("node_type", ""))


def _json(path: Path) -> dict[str, Any]:
    if not path.is_file() or path.stat().st_size > 1 << 24:
        return {}
    try:
        found = parse_json(path.read_bytes())
    except ValueError as error:
        raise damaged(path, first_line(error)) from None
    return found if isinstance(found, dict) else {}


def _array(folder: Path, place: Path) -> StoredArray:
    import zarr

    item = zarr.open_array(store=str(place), mode="r")
    name = place.relative_to(folder).as_posix() if place != folder else folder.stem
    shape = tuple(int(n) for n in item.shape)
    attributes: Mapping[str, Any] = dict(item.attrs)
    axes, steps, units = _ome(place, len(shape))
    if not axes:
        named = attributes.get("_ARRAY_DIMENSIONS") or getattr(item.metadata, "dimension_names", ())
        axes = tuple(str(each or "") for each in named or ())

    def read(index: Any) -> np.ndarray[Any, Any]:
        _check_chunks(place, item)
        return np.asarray(item[index])

    return StoredArray(
        name, shape, np.dtype(item.dtype), read, axes, steps, units,
        channels=_channels(place), **described(attributes),
    )  # fmt: skip


def _group_data(place: Path) -> dict[str, Any]:
    """Return OME's metadata of the group around an array."""
    group = place.parent
    data = _json(group / "zarr.json").get("attributes", {}) or _json(group / ".zattrs")
    data = data.get("ome", data) if isinstance(data, dict) else {}
    return data if isinstance(data, dict) else {}


def _channels(place: Path) -> tuple[str, ...]:
    """Return the names of the channels by OME; empty without any."""
    try:
        return tuple(str(c.get("label", "")) for c in _group_data(place)["omero"]["channels"])
    except (TypeError, KeyError, AttributeError):
        return ()


def _check_chunks(place: Path, item: Any) -> None:
    """Check that the chunks can hold the voxels, before memory is taken."""
    own = place.resolve()
    each = math.prod(int(n) for n in item.chunks) * np.dtype(item.dtype).itemsize
    if not 0 < each <= MOST_CHUNK:
        raise damaged(place, f"its chunks have {each} bytes")
    present, count = 0, 0
    for path in place.rglob("*"):
        if path.is_symlink() and not path.resolve().is_relative_to(own):
            raise VolumeError(
                f"{path}: it is a link that leads out of its folder, from which nothing is read; "
                "put the files themselves here."
            )
        if path.is_file() and path.name not in (*HEADS, ".zattrs", ".zmetadata"):
            present, count = present + path.stat().st_size, count + 1
    if not count:
        raise damaged(place, "none of its chunks is there")
    # Chunks that are not there have the fill value.
    need = math.prod(item.shape) * np.dtype(item.dtype).itemsize
    if need > max(present * GREATEST_RATIO, MOST_UNWRITTEN):
        raise damaged(place, "its chunks are too few for its voxels")


def _ome(
    place: Path, axes: int
) -> tuple[tuple[str, ...], tuple[float | None, ...], tuple[str, ...]]:
    """Return names, steps and units of axes by the OME metadata of the group around."""
    scales = _group_data(place).get("multiscales")
    try:
        first = scales[0]  # type: ignore[index]
        names = [axis if isinstance(axis, str) else axis["name"] for axis in first["axes"]]
        units = ["" if isinstance(axis, str) else axis.get("unit", "") for axis in first["axes"]]
        (level,) = (d for d in first["datasets"] if d["path"] == place.name)
        found = [t["scale"] for t in level.get("coordinateTransformations", []) if "scale" in t]
        whole = [t["scale"] for t in first.get("coordinateTransformations", []) if "scale" in t]
        steps = np.ones(axes)
        for scale in (*found, *whole):
            steps = steps * np.array(scale, float)
    except (TypeError, KeyError, IndexError, ValueError):
        return (), (), ()
    if len(names) != axes or len(steps) != axes:
        return (), (), ()
    sizes = tuple(float(step) for step in steps) if found or whole else (None,) * axes
    return tuple(map(str, names)), sizes, tuple(map(str, units))
