"""Arrays with any number of axes, as in NumPy and HDF5 files: which to read, and how."""

import math
import re
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.volume import Content, FileFacts, Label
from model.volume_files.checks import (
    check_grid,
    check_present,
    errors_of,
    not_a,
    times,
    truncated,
    unsupported,
)
from model.volume_files.choice import LARGEST, AskedKind, Choice, chosen, chosen_index, content
from model.volume_files.conventions import (
    Axis,
    Coordinates,
    attribute_text,
    axes_of,
    decoded,
    evened,
)
from model.volume_files.grid import Grid, in_one_unit, placed, proposed_stretch

Index = tuple[int | slice, ...]

MOST_COMPONENTS = 4  # largest length of a last axis that counts as components
MOST_UNEVEN = 8.0  # ratio of an axis's largest to smallest distance from which it is refused

_AUXILIARY = re.compile(
    r"(^|[^a-z])(ids?|index|ghost\w*|masks?|valid\w*|labels?|process\w*|rank)([^a-z]|$)|"
    r"(Ids?|GhostType|Mask)$|^vtk|OriginalCell",
    re.IGNORECASE,
)


@dataclass(frozen=True, eq=False)
class StoredArray:
    """An array in a file, unread; its shape has the slowest axis first.

    `read` takes an index or a slice for each axis; masked voxels are missing. Attributes and
    coordinates have CF's names; an axis ``"components"`` is none of space. `spacing`, `origin` and
    `directions` are along x, y and z, where a program gives them by themselves; row k of the
    directions points along axis k. `is_netcdf` says whether values that were never written have
    NetCDF's default fill value, and `is_active` whether programs show this array first.
    """

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[Index], NDArray[Any]]
    axes: tuple[str, ...] = ()
    attributes: Mapping[str, Any] = field(default_factory=dict)
    coordinates: Coordinates = field(default_factory=dict)
    spacing: Sequence[float | None] | None = None
    unit: str = ""
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    directions: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    is_netcdf: bool = False
    is_active: bool = False
    is_labels: bool = False
    labels: tuple[Label, ...] = ()


@dataclass(frozen=True, eq=False)
class _Roles:
    """Roles of an array's axes: x, y and z, components, and time, channel or other."""

    axes: list[Axis]
    z: int
    y: int
    x: int
    components: int | None
    times: tuple[int, ...]
    channels: tuple[int, ...]
    notes: tuple[str, ...] = ()


def is_auxiliary(name: str) -> bool:
    """Return True for names of ids, masks, ghost types, labels and the like, which come last."""
    *folders, last = name.split("/")
    return _AUXILIARY.search(last) is not None or "labels" in folders


def grid_of_arrays(
    path: Path,
    arrays: Sequence[StoredArray],
    choice: Choice,
    file_format: str,
    kind: Literal["array", "series"] = "array",
) -> Grid:
    """Read the chosen array of a file, or the largest that is no mask or list of ids.

    Series are listed in the file's order.
    """
    found = [(array, _roles(array)) for array in arrays if array.dtype.kind in "biufc"]
    usable = [(array, roles) for array, roles in found if roles]
    if not usable:
        raise _no_volume(path, arrays)
    usable_first = sorted(usable, key=_rank)
    usable = usable_first if kind == "array" else usable
    names = [array.name for array, _ in usable]
    default = usable.index(usable_first[0])
    number = chosen_index(path, kind, names, getattr(choice, kind), default)
    listed = tuple(
        content(kind, array.name, _dimensions(array, roles), array.dtype, k == number)
        for k, (array, roles) in enumerate(usable)
    )
    return _grid(path, *usable[number], choice, file_format, listed if len(listed) > 1 else ())


def _rank(each: tuple[StoredArray, _Roles]) -> tuple[bool, bool, int]:
    """Sort key that puts arrays of data before the others."""
    is_last = each[0].is_labels or is_auxiliary(each[0].name)
    return is_last, not each[0].is_active, -math.prod(_dimensions(*each))


def _no_volume(path: Path, arrays: Sequence[StoredArray]) -> VolumeError:
    if not arrays:
        return VolumeError(f"{path}: the file holds no arrays; choose another.")
    listed = ", ".join(
        f"{a.name} ({times(a.shape[::-1]) or 'a number'}, {a.dtype})" for a in arrays[:6]
    )
    return VolumeError(
        f"{path}: none of its arrays is a volume of real numbers with at least two voxels along "
        f"three axes: {listed}{' and more' if len(arrays) > 6 else ''}; choose another file."
    )


def _grid(
    path: Path,
    array: StoredArray,
    roles: _Roles,
    choice: Choice,
    file_format: str,
    listed: tuple[Content, ...],
) -> Grid:
    dimensions = _dimensions(array, roles)
    dtype = array.dtype
    if dtype.kind == "c" and roles.components is not None:
        raise unsupported(path, "an array of complex vectors", "save one component")
    count = 1 if roles.components is None else array.shape[roles.components]
    check_grid(path, dimensions, dtype, count)
    fixed: dict[int, int] = {}
    kinds: tuple[tuple[AskedKind, tuple[int, ...]], ...]
    kinds = ("time", roles.times), ("channel", roles.channels)
    for kind, axes in kinds:
        shape = [array.shape[k] for k in axes]
        names = [str(k) for k in range(math.prod(shape))]
        if kind == "channel" and len({*array.channels} - {""}) == len(names):
            names = [*array.channels]
        at, alike = chosen(path, kind, names, choice, dimensions, dtype)
        listed += alike
        if shape:
            fixed |= zip(axes, (int(k) for k in np.unravel_index(at, shape)), strict=True)
    values = array.read(tuple(fixed.get(k, slice(None)) for k in range(len(array.shape))))
    values = _in_order(values, [k for k in range(len(array.shape)) if k not in fixed], roles)
    hidden: Any = np.ma.getmask(values)
    values = _plain(np.ma.getdata(values))
    values, missing, notes = decoded(values, array.attributes, array.is_netcdf)
    if hidden is not np.ma.nomask:
        missing = hidden if missing is None else missing | hidden
    if missing is not None and missing.ndim == 4:
        missing = np.asarray(missing.any(axis=-1))
    units = attribute_text(array.attributes, "units")
    grid = Grid(
        values,
        origin=array.origin,
        units="" if units == "1" else units,
        notes=array.notes + roles.notes + notes,
        missing=missing,
        facts=FileFacts(
            file_format, array.unit, contents=listed, is_labels=array.is_labels, labels=array.labels
        ),
    )
    if array.spacing is None and any(roles.axes[k].step for k in (roles.x, roles.y, roles.z)):
        return _by_coordinates(path, grid, [roles.axes[k] for k in (roles.x, roles.y, roles.z)])
    return placed(grid, array.spacing, array.directions)


def _by_coordinates(path: Path, grid: Grid, axes: list[Axis]) -> Grid:
    """Place a grid by the positions along x, y and z, with the upward axis up."""
    values, missing, notes = grid.values, grid.missing, grid.notes
    for k, axis in enumerate(axes):
        if axis.is_even or axis.numbers is None:
            continue
        gaps = np.abs(np.diff(axis.numbers))
        if gaps.max() >= MOST_UNEVEN * gaps.min():
            raise VolumeError(
                f"{path}: the values along '{axis.name}' are {gaps.min():g} to {gaps.max():g} "
                "apart, too unlike for a grid of equal steps; interpolate them, for example with "
                "xarray's interp or cdo's intlevel."
            )
        values, missing, axes[k], note = evened(values, missing, 2 - k, axis)
        notes += (note,)
    steps = [axis.step for axis in axes]
    starts = [0.0 if axis.numbers is None else float(axis.numbers[0]) for axis in axes]
    vertical = axes[2]
    if vertical.is_down and steps[2]:
        # Depths become heights by a change of sign.
        steps[2], starts[2] = -steps[2], -starts[2]
        if steps[2] < 0:
            count = values.shape[0]
            values, missing = values[::-1], None if missing is None else missing[::-1]
            starts[2] += (count - 1) * steps[2]
            steps[2] = -steps[2]
            notes += (
                f"The values of '{vertical.name}' grow downwards; z is read in reverse order, so "
                "that what is above is shown above.",
            )
    lengths, unit, unit_notes = in_one_unit(steps, [axis.unit for axis in axes])
    factors = [b / a if a and b else 1.0 for a, b in zip(steps, lengths, strict=True)]
    stretch = 1.0
    if unit_notes:
        stretch, note = proposed_stretch(lengths, values.shape[2::-1], [a.unit for a in axes])
        unit_notes, factors[2] = (note,), factors[2] * stretch
        lengths[2] = None if lengths[2] is None else lengths[2] * stretch
    origin = [start * f for start, f in zip(starts, factors, strict=True)]
    grid = replace(
        grid,
        values=values,
        missing=missing,
        origin=origin,
        notes=notes + unit_notes,
        up="" if vertical.is_down is None and axes[0].unit[:6] != "degree" else "+z",
        facts=replace(grid.facts, spacing_unit=unit, stretch=stretch),
    )
    return placed(grid, lengths)


def _dimensions(array: StoredArray, roles: _Roles) -> tuple[int, int, int]:
    return array.shape[roles.x], array.shape[roles.y], array.shape[roles.z]


def _roles(array: StoredArray) -> _Roles | None:
    """Assign roles to an array's axes by names, or by order; None for no volume."""
    if sum(n > 1 for n in array.shape) < 3:
        # Coordinates and tables, of which a file may have thousands.
        return None
    is_named = len(array.axes) == len(array.shape)
    names = array.axes if is_named else ("",) * len(array.shape)
    axes = axes_of(names, array.coordinates)
    long = [k for k, n in enumerate(array.shape) if n > 1]
    components = next((k for k in long if axes[k].letter == "v"), None)
    long = [k for k in long if k != components]
    if len(long) < 3:
        return None
    times = [k for k in long if axes[k].letter == "t"]
    channels = [k for k in long if axes[k].letter == "c"]
    if len(long) - len(times) - len(channels) < 3:
        # The axis c is not a channel, as for the axes a, b and c of a crystal.
        channels = []
    rest = [k for k in long if k not in times and k not in channels]
    if components is None and len(rest) > 3 and rest[-1] == long[-1]:
        small, is_apart = array.shape[rest[-1]], axes[rest[-1]].letter not in ("x", "y", "z")
        if is_apart and small <= min(MOST_COMPONENTS, *(array.shape[k] - 1 for k in rest[-4:-1])):
            components = rest.pop()
    notes: tuple[str, ...] = ()
    if len(rest) == 2 and times:
        # Images over time alone.
        rest.insert(0, times.pop())
        notes = ("The file calls its images time steps; they are taken for slices of a volume.",)
    if len(rest) < 3:
        return None
    place = {axes[k].letter: k for k in reversed(rest) if axes[k].letter in ("x", "y", "z")}
    free = [k for k in rest if k not in place.values()]
    unnamed = [letter for letter in "zyx" if letter not in place]
    if len(free) < len(unnamed):
        return None
    place |= zip(unnamed, free[len(free) - len(unnamed) :], strict=True)
    times += [k for k in rest if k not in place.values()]
    z, y, x = (place[letter] for letter in "zyx")
    return _Roles(axes, z, y, x, components, tuple(sorted(times)), tuple(channels), notes)


def _in_order(values: NDArray[Any], kept: Sequence[int], roles: _Roles) -> NDArray[Any]:
    """Order axes as z, y, x and components, without axes of one value."""
    wanted = [roles.z, roles.y, roles.x, *([] if roles.components is None else [roles.components])]
    values = values[tuple(slice(None) if k in wanted else 0 for k in kept)]
    left = [k for k in kept if k in wanted]
    return np.transpose(values, [left.index(k) for k in wanted])


def _plain(values: NDArray[Any]) -> NDArray[Any]:
    """Return values as numbers in native byte order."""
    if values.dtype.kind == "f" and values.dtype.itemsize > 8:
        return values.astype(np.float64)
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    if values.dtype.kind == "c":
        values = np.stack([values.real, values.imag], axis=-1)
    if values.dtype == np.float16:
        return values.astype(np.float32)
    return values if values.dtype.isnative else values.astype(values.dtype.newbyteorder("="))


def rescaled(values: NDArray[Any], slope: float, intercept: float) -> NDArray[Any]:
    """Return a straight line of values, as numbers that hold them."""
    if (slope, intercept) == (1.0, 0.0):
        return values
    wide = values.dtype.itemsize > 4 or values.dtype in (np.int32, np.uint32)
    values = values.astype(np.float64 if wide else np.float32)
    values *= slope
    values += intercept
    return values


def read_numpy(path: Path, choice: Choice = LARGEST) -> Grid:
    """Read an array saved by NumPy, its last axis being x."""
    with errors_of(path, "NumPy says '{}'"):
        try:
            if path.suffix.lower() == ".npy":
                data = np.load(path, mmap_mode="r", allow_pickle=False)
                array = StoredArray(path.stem, data.shape, data.dtype, lambda k: np.array(data[k]))
                return grid_of_arrays(path, [array], choice, "NumPy array")
            with zipfile.ZipFile(path) as archive:
                members = [info for info in archive.infolist() if info.filename.endswith(".npy")]
                arrays = [_member(path, archive, info) for info in members]
                return grid_of_arrays(path, arrays, choice, "NumPy archive")
        except (ValueError, zipfile.BadZipFile) as error:
            with path.open("rb") as file:
                is_archive = file.read(4) == b"PK\x03\x04"
            if is_archive and not zipfile.is_zipfile(path):
                raise truncated(path, "it lacks the list of its arrays, at its end") from None
            if "magic string" in str(error):
                raise not_a(path, "an array saved by NumPy") from None
            if "mmap length" in str(error):
                raise truncated(path, "it is shorter than its header says") from None
            raise


def _member(path: Path, archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> StoredArray:
    head = np.lib.format
    with archive.open(info) as file:
        is_old = head.read_magic(file) == (1, 0)
        read_head = head.read_array_header_1_0 if is_old else head.read_array_header_2_0
        shape, _, dtype = read_head(file)

    def read(index: Any) -> NDArray[Any]:
        need = math.prod(int(n) for n in shape) * dtype.itemsize
        check_present(path, info.file_size, need)
        with archive.open(info) as file:
            return np.asarray(head.read_array(file, allow_pickle=False)[index])

    return StoredArray(info.filename.removesuffix(".npy"), shape, dtype, read)
