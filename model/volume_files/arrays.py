"""Arrays of any number of axes, as containers such as HDF5 hold them: which to read, and how."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.file_facts import Content, FileFacts
from model.volume_files.checks import check_grid, times, unsupported
from model.volume_files.choice import AskedKind, Choice, choice_notes, chosen, chosen_index, content
from model.volume_files.frame import in_one_unit, unmirrored, usable_origin, usable_spacing
from model.volume_files.grid import Grid

Index = tuple[int | slice, ...]

MOST_COMPONENTS = 4
"""Length of a last axis up to which it is taken for components."""

_AUXILIARY = re.compile(
    r"(^|[^a-z])(ids?|index|ghost\w*|masks?|valid\w*|labels?|process\w*|rank)([^a-z]|$)|"
    r"(Ids?|GhostType|Mask)$|^vtk|OriginalCell",
    re.IGNORECASE,
)
_TIME, _CHANNEL = (
    re.compile(r"^(t|time\w*|frames?)$", re.I),
    re.compile(r"^(c|ch\w*|bands?)$", re.I),
)
_X, _Y, _Z = (
    re.compile(r"^(x\w*|lon\w*|columns?|cols?|width)$", re.IGNORECASE),
    re.compile(r"^(y\w*|lat\w*|rows?|height)$", re.IGNORECASE),
    re.compile(r"^(z\w*|lev\w*|depth\w*|alt\w*|plev|planes?|slices?|pressure)$", re.IGNORECASE),
)


@dataclass(frozen=True, eq=False)
class StoredArray:
    """An array in a file, unread.

    Attributes
    ----------
    shape : tuple of int
        Slowest axis first.
    dtype : numpy.dtype
    read : callable
        Reads a part, given an index or a slice for each axis.
    axes : tuple of str
        Names of the axes; empty if they have none.
    steps, units_of_steps : tuple
        Distance of values along each axis with its sign, or None, and its unit; may be empty.
    starts : tuple of float
        Position of the first value along each axis; may be empty.
    fills : tuple of float
        Stored values that stand for what is missing.
    valid : tuple of float or None
        Least and greatest stored value that are valid.
    slope, intercept : float
        From stored to true values.
    units : str
        Of the values.
    channels : tuple of str
        Names of the channels; empty if they have none.
    """

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    read: Callable[[Index], NDArray[Any]]
    axes: tuple[str, ...] = ()
    steps: tuple[float | None, ...] = ()
    units_of_steps: tuple[str, ...] = ()
    starts: tuple[float, ...] = ()
    fills: tuple[float, ...] = ()
    valid: tuple[float, float] | None = None
    slope: float = 1.0
    intercept: float = 0.0
    units: str = ""
    notes: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Roles:
    """Which axes of an array are x, y and z, components, and time, channel or neither."""

    z: int
    y: int
    x: int
    components: int | None
    times: tuple[int, ...]
    channels: tuple[int, ...]


def is_auxiliary(name: str) -> bool:
    """Return True for names of ids, masks, ghost types and the like, which come last."""
    return _AUXILIARY.search(name.rpartition("/")[2]) is not None


def grid_of_arrays(
    path: Path, arrays: Sequence[StoredArray], choice: Choice, file_format: str
) -> Grid:
    """Read the chosen array of a file, or the largest that is no mask or list of ids."""
    usable = [array for array in arrays if array.dtype.kind in "biufc" and _roles(array)]
    if not usable:
        raise _no_volume(path, arrays)
    usable.sort(key=lambda array: (is_auxiliary(array.name), -math.prod(_dimensions(array))))
    names = [array.name for array in usable]
    number = chosen_index(path, "array", names, choice.array)
    listed = tuple(
        content("array", array.name, _dimensions(array), array.dtype, k == number)
        for k, array in enumerate(usable)
    )
    return _grid(path, usable[number], choice, file_format, listed if len(listed) > 1 else ())


def _no_volume(path: Path, arrays: Sequence[StoredArray]) -> VolumeError:
    if not arrays:
        return VolumeError(f"{path}: the file holds no arrays; choose another.")
    listed = ", ".join(
        f"{a.name} ({times(a.shape[::-1]) or 'a number'}, {a.dtype})" for a in arrays[:6]
    )
    return VolumeError(
        f"{path}: none of its arrays is a volume of real numbers with at least two voxels along "
        f"three axes: {listed}{' and more' if len(arrays) > 6 else ''}."
    )


def _grid(
    path: Path, array: StoredArray, choice: Choice, file_format: str, listed: tuple[Content, ...]
) -> Grid:
    roles = _roles(array)
    assert roles is not None
    dimensions = _dimensions(array)
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
    if dtype.kind == "f" and dtype.itemsize > 8:
        values = values.astype(np.float64)
    values = _in_order(values, [k for k in range(len(array.shape)) if k not in fixed], roles)
    values, missing = _valued(array, values)
    return _placed(array, roles, values, missing, file_format, listed)


def _placed(
    array: StoredArray,
    roles: _Roles,
    values: NDArray[Any],
    missing: NDArray[np.bool_] | None,
    file_format: str,
    listed: tuple[Content, ...],
) -> Grid:
    """Return the grid of an array's values, with what the file says of their places."""
    order = (roles.x, roles.y, roles.z)
    steps = [array.steps[k] if array.steps else None for k in order]
    units = [array.units_of_steps[k] if array.units_of_steps else "" for k in order]
    starts = [array.starts[k] if array.starts else 0.0 for k in order]
    lengths, unit, unit_notes = in_one_unit(steps, units)
    factors = [b / a if a and b else 1.0 for a, b in zip(steps, lengths, strict=True)]
    origin = usable_origin([start * f for start, f in zip(starts, factors, strict=True)])
    values, origin, mirror_notes = unmirrored(values, lengths, origin)
    if missing is not None:
        missing, _, _ = unmirrored(missing, lengths, origin)  # type: ignore[assignment]
    spacing, spacing_notes = usable_spacing(lengths)
    return Grid(
        values,
        spacing,
        origin,
        array.units,
        choice_notes(listed) + array.notes + unit_notes + mirror_notes + spacing_notes,
        missing=missing,
        facts=FileFacts(file_format, unit, contents=listed),
    )


def _dimensions(array: StoredArray) -> tuple[int, int, int]:
    roles = _roles(array)
    assert roles is not None
    return array.shape[roles.x], array.shape[roles.y], array.shape[roles.z]


def _roles(array: StoredArray) -> _Roles | None:
    """Tell an array's axes apart, by their names or else by their order; None for no volume."""
    long = [k for k, n in enumerate(array.shape) if n > 1]
    names = array.axes if len(array.axes) == len(array.shape) else ("",) * len(array.shape)
    times = [k for k in long if _TIME.match(names[k])]
    channels = [k for k in long if _CHANNEL.match(names[k])]
    rest = [k for k in long if k not in times and k not in channels]
    components = None
    if len(rest) > 3 and rest[-1] == long[-1] and not _is_spatial(names[rest[-1]]):
        small = array.shape[rest[-1]]
        if small <= MOST_COMPONENTS and all(array.shape[k] > small for k in rest[-4:-1]):
            components = rest.pop()
    named = [next((k for k in rest if p.match(names[k])), None) for p in (_Z, _Y, _X)]
    if None not in named:
        z, y, x = named
    elif len(rest) >= 3:
        z, y, x = rest[-3:]
    elif len(rest) == 2 and times:
        # Images over time alone: they are taken for slices.
        y, x = rest
        z = times.pop()
    else:
        return None
    assert z is not None and y is not None and x is not None
    times += [k for k in rest if k not in (z, y, x)]
    return _Roles(z, y, x, components, tuple(sorted(times)), tuple(channels))


def _is_spatial(name: str) -> bool:
    return any(pattern.match(name) for pattern in (_X, _Y, _Z))


def _in_order(values: NDArray[Any], kept: Sequence[int], roles: _Roles) -> NDArray[Any]:
    """Put what was read into the order z, y, x and components, without axes of one value."""
    wanted = [roles.z, roles.y, roles.x, *([] if roles.components is None else [roles.components])]
    values = values[tuple(slice(None) if k in wanted else 0 for k in kept)]
    left = [k for k in kept if k in wanted]
    return np.transpose(values, [left.index(k) for k in wanted])


def _valued(
    array: StoredArray, values: NDArray[Any]
) -> tuple[NDArray[Any], NDArray[np.bool_] | None]:
    """Return true values in native byte order, and where they are missing."""
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    if values.dtype.kind == "c":
        values = np.stack([values.real, values.imag], axis=-1)
    if values.dtype == np.float16:
        values = values.astype(np.float32)
    if not values.dtype.isnative:
        values = values.astype(values.dtype.newbyteorder("="))
    missing: NDArray[np.bool_] | None = None
    if values.ndim == 3:
        for fill in array.fills:
            found = _equal(values, fill)
            missing = found if missing is None else missing | found
        if array.valid is not None:
            low, high = array.valid
            found = (values < low) | (values > high)
            missing = found if missing is None else missing | found
    values = rescaled(values, array.slope, array.intercept)
    return values, missing if missing is not None and missing.any() else None


def rescaled(values: NDArray[Any], slope: float, intercept: float) -> NDArray[Any]:
    """Return a straight line of values, as numbers that hold them."""
    if (slope, intercept) == (1.0, 0.0):
        return values
    wide = values.dtype.itemsize > 4 or values.dtype in (np.int32, np.uint32)
    values = values.astype(np.float64 if wide else np.float32)
    values *= slope
    values += intercept
    return values


def _equal(values: NDArray[Any], fill: float) -> NDArray[np.bool_]:
    if math.isnan(fill):
        return np.isnan(values) if values.dtype.kind == "f" else np.zeros(values.shape, bool)
    if values.dtype.kind == "f":
        # A value of 1e20 is another number in 32 bits than in 64.
        return values == values.dtype.type(fill)
    return values == fill


def attribute_number(attributes: Mapping[str, Any], *names: str) -> float | None:
    """Return the first of some attributes that is a finite number; None if there is none."""
    for name in names:
        found = attribute_numbers(attributes, name)
        if len(found) == 1 and math.isfinite(found[0]):
            return found[0]
    return None


def attribute_numbers(attributes: Mapping[str, Any], name: str) -> list[float]:
    """Return an attribute's numbers; empty if it is missing or holds none."""
    try:
        value = attributes.get(name)
        return [] if value is None else [float(each) for each in np.ravel(value)[:64]]
    except Exception:
        # Attributes of types that the library does not know.
        return []


def attribute_text(attributes: Mapping[str, Any], name: str) -> str:
    """Return an attribute as text; empty if it is missing."""
    try:
        value = attributes.get(name)
        if isinstance(value, np.ndarray):
            value = value.ravel()[0] if value.size else ""
        return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
    except Exception:
        return ""
