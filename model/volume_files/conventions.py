"""The CF conventions for an array's values and axes, by xarray and cf_xarray.

Whole files are not opened with xarray: it reads other files that they name, and fails on one bad
variable.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Attributes = Mapping[str, Any]
Coordinates = Mapping[str, tuple[NDArray[Any], Attributes]]
"""Stored values along axes, and their attributes, by names of axes."""

EVEN = 1e-2  # relative difference up to which steps of a coordinate count as equal
NEXT_TO = 1e-6  # least share of a missing voxel that makes an interpolated one missing
_FILLS, _SCALES = ("_FillValue", "missing_value"), ("scale_factor", "add_offset")
_TEXTS = ("units", "positive", "axis", "standard_name")
_LETTERS = {"longitude": "x", "latitude": "y", "vertical": "z", "time": "t"}
_PRESSURE = ("pa", "hpa", "kpa", "mb", "mbar", "millibar", "millibars", "bar", "dbar", "decibar")
_WORDS = {
    **dict.fromkeys(("column", "columns", "col", "cols", "width"), "x"),
    **dict.fromkeys(("row", "rows"), "y"),
    **dict.fromkeys(("plane", "planes", "slice", "slices", "plev", "alt", "pressure"), "z"),
    **dict.fromkeys(("frame", "frames"), "t"),
    **dict.fromkeys(("c", "ch", "channel", "channels", "band", "bands"), "c"),
    "components": "v",
}
"""Names of axes that cf_xarray does not know."""

DEFAULT_FILLS = {
    "i2": -32767, "u2": 65535, "i4": -2147483647, "u4": 4294967295,
    "i8": -9223372036854775806, "u8": 18446744073709551614,
    "f4": 9.969209968386869e36, "f8": 9.969209968386869e36,
}  # fmt: skip
"""NetCDF's default fill values, by type; bytes have none."""


@dataclass(frozen=True, eq=False)
class Axis:
    """One axis of an array: x, y, z, t for time, c for channels, v for components, or "".

    `numbers` are strictly monotonic positions. `is_down` says whether those of a vertical axis grow
    downwards; None if unknown.
    """

    name: str
    letter: str = ""
    numbers: NDArray[np.float64] | None = None
    unit: str = ""
    is_down: bool | None = None

    @property
    def step(self) -> float | None:
        """Typical distance of neighbors, with its sign; None if unknown."""
        return None if self.numbers is None else float(np.median(np.diff(self.numbers)))

    @property
    def is_even(self) -> bool:
        """Whether all distances are equal."""
        if self.numbers is None:
            return True
        steps = np.diff(self.numbers)
        return bool(np.abs(steps - np.median(steps)).max() <= EVEN * abs(np.median(steps)))


def axes_of(names: tuple[str, ...], coordinates: Coordinates) -> list[Axis]:
    """Describe axes by their names and coordinates."""
    words = [name.lower() for name in names]
    if not coordinates and all(len(word) < 2 or word in _WORDS for word in words):
        return [Axis(n, _WORDS.get(w, w if w in "xyzt" else "")) for n, w in zip(names, words)]  # noqa: B905
    import cf_xarray  # noqa: F401
    import xarray
    from cf_xarray.criteria import regex

    stored = {
        name: ((name,), values, _packing(attributes, values.dtype) | _texts(attributes))
        for name, (values, attributes) in coordinates.items()
        if values.dtype.kind in "iuf"
    }
    found = xarray.decode_cf(xarray.Dataset(stored), decode_times=False)
    found = found.set_coords(list(stored))
    letters = {
        name: _LETTERS.get(kind, kind.lower())
        for kinds in (found.cf.coordinates, found.cf.axes)
        for kind, its_names in kinds.items()
        for name in its_names
    }
    axes = []
    for name, word in zip(names, words, strict=True):
        guess = next((kind for kind, names in regex.items() if names.fullmatch(word)), "")
        guess = _WORDS.get(word, _LETTERS.get(guess, guess.lower()))
        letter = letters.get(name, word if word in ("x", "y", "z", "t") else guess)
        axes.append(_axis(name, letter, found[name] if name in stored else None))
    return axes


def _axis(name: str, letter: str, coordinate: Any) -> Axis:
    if coordinate is None:
        return Axis(name, letter)
    unit = str(coordinate.attrs.get("units", ""))
    numbers = np.asarray(coordinate.values, np.float64)
    if letter == "x" and unit.lower().startswith("degree") and np.isfinite(numbers).all():
        numbers = np.unwrap(numbers, period=360.0)
    steps = np.diff(numbers)
    is_monotonic = len(steps) and ((steps > 0).all() or (steps < 0).all())
    is_down = None
    if letter == "z":
        positive = str(coordinate.attrs.get("positive", "")).lower()
        standard = str(coordinate.attrs.get("standard_name", "")) or name
        if positive in ("up", "down"):
            is_down = positive == "down"
        elif unit.lower() in _PRESSURE or standard.lower().startswith("depth"):
            is_down = True
        elif coordinate.attrs.get("axis") == "Z":
            is_down = False
    unit = "" if unit == "1" else unit
    return Axis(name, letter, numbers if is_monotonic else None, unit, is_down)


def decoded(
    values: NDArray[Any], attributes: Attributes, is_netcdf: bool = False
) -> tuple[NDArray[Any], NDArray[np.bool_] | None, tuple[str, ...]]:
    """Decode stored values by their attributes; return them, the missing ones, and notes.

    NetCDF files without a declared fill value have the library's own.
    """
    dtype = values.dtype
    if dtype.kind not in "iuf":
        return values, None, ()
    packing = _packing(attributes, dtype)
    if is_netcdf and not packing.keys() & {*_FILLS}:
        default = DEFAULT_FILLS.get(dtype.str[1:])
        if default is not None and (values == dtype.type(default)).any():
            packing["_FillValue"] = dtype.type(default)
    missing: NDArray[np.bool_] | None = None
    found = values
    if packing:
        if packing.keys() & {*_SCALES}:
            is_small = dtype.itemsize <= 2
            kind = np.dtype(np.float32) if is_small else _unpacked(values[0], packing).dtype
            found = np.empty(values.shape, kind)
        else:
            found = values.view(f"u{dtype.itemsize}" if "_Unsigned" in packing else dtype)
        missing = np.zeros(values.shape, bool) if packing.keys() & {*_FILLS} else None
        # Plane by plane, as intermediate numbers take more memory than the volume.
        for k, plane in enumerate(values):
            numbers = _unpacked(plane, packing)
            if missing is not None:
                missing[k] = np.isnan(numbers)
                numbers[missing[k]] = 0
            found[k] = numbers
    outside = _outside(found, dtype, attributes, packing)
    if outside is None or not outside.any():
        return found, missing, ()
    both = outside if missing is None else outside | missing
    if both.all():
        note = "The file's valid range holds none of its values; it is ignored."
        return found, missing, (note,)
    return found, both, ()


def _unpacked(values: NDArray[Any], packing: dict[str, Any]) -> NDArray[Any]:
    """Unpack values, with NaN for missing ones."""
    import xarray

    names = [f"axis{k}" for k in range(values.ndim)]
    stored = xarray.Dataset({"values": (names, values, packing)})
    found: NDArray[Any] = xarray.decode_cf(stored, decode_times=False)["values"].values
    return found


def _outside(
    values: NDArray[Any], stored: np.dtype[Any], attributes: Attributes, packing: dict[str, Any]
) -> NDArray[np.bool_] | None:
    """Return where values are outside the valid range; None where there is none."""
    both = attribute_numbers(attributes, "valid_range")
    names = ("valid_range", "valid_range") if len(both) == 2 else ("valid_min", "valid_max")
    ends = both if len(both) == 2 else [attribute_number(attributes, name) for name in names]
    if not any(end is not None for end in ends):
        return None
    slope, offset = packing.get("scale_factor", 1.0), packing.get("add_offset", 0.0)
    limits = []
    for end, name, endless in zip(ends, names, (-math.inf, math.inf), strict=True):
        if end is None:
            limits.append(endless if slope > 0 else -endless)
            continue
        if packing.get("_Unsigned") == "true" and end < 0:
            end += 1 << (8 * stored.itemsize)
        # Limits of a wider type than the packed values' refer to unpacked ones.
        is_unpacked = stored.kind in "iu" and np.asarray(attributes[name]).dtype.kind == "f"
        limits.append(end if is_unpacked else end * slope + offset)
    low, high = sorted(limits)
    return (values < low) | (values > high) if low < high else None


def evened(
    values: NDArray[Any], missing: NDArray[np.bool_] | None, along: int, axis: Axis
) -> tuple[NDArray[Any], NDArray[np.bool_] | None, Axis, str]:
    """Interpolate values linearly to equal distances along an axis; also return a note."""
    from scipy.interpolate import interp1d

    old = axis.numbers
    assert old is not None
    gaps = np.abs(np.diff(old))
    count = round(abs(old[-1] - old[0]) / gaps.min()) + 1
    new = np.linspace(old[0], old[-1], count)
    kind = values.dtype if values.dtype.kind == "f" else np.dtype(np.float32)
    result = interp1d(old, values, axis=along)(new).astype(kind)
    back = None
    if missing is not None:
        # Voxels next to a missing one are missing.
        back = interp1d(old, missing.astype(np.float32), axis=along)(new) > NEXT_TO
    farthest = np.abs(new[:, None] - old).min(axis=1).max()
    unit = f" {axis.unit}" if axis.unit else ""
    note = (
        f"The values along '{axis.name}' are {gaps.min():g} to {gaps.max():g}{unit} apart; they "
        f"are interpolated to one every {abs(new[1] - new[0]):.4g}{unit}, which is up to "
        f"{farthest:.4g}{unit} from those of the file."
    )
    return result, back, replace(axis, numbers=new), note


def _texts(attributes: Attributes) -> dict[str, str]:
    """Return the attributes that identify an axis."""
    return {name: text for name in _TEXTS if (text := attribute_text(attributes, name))}


def _packing(attributes: Attributes, dtype: np.dtype[Any]) -> dict[str, Any]:
    """Return the attributes for xarray to decode, as numbers of the right type."""
    found: dict[str, Any] = {}
    for name in _FILLS:
        fills = [fill for n in attribute_numbers(attributes, name) for fill in _fill(n, dtype)]
        if fills:
            found[name] = fills[0] if len(fills) == 1 else np.array(fills)
    slope, offset = (attribute_number(attributes, name) for name in _SCALES)
    found |= {"scale_factor": slope} if slope not in (None, 0.0, 1.0) else {}
    found |= {"add_offset": offset} if offset else {}
    if attribute_text(attributes, "_Unsigned").lower() == "true" and dtype.kind == "i":
        found["_Unsigned"] = "true"
    return found


def _fill(number: float, dtype: np.dtype[Any]) -> list[Any]:
    """Return a fill value in the stored type, or none if it does not fit."""
    if dtype.kind == "f":
        return [dtype.type(number)]
    if not math.isfinite(number):
        return []
    wide = 1 << (8 * dtype.itemsize)
    fill = np.array(int(number) % wide, f"u{dtype.itemsize}").astype(dtype)
    return [fill[()]] if -wide // 2 <= number < wide else []


def attribute_number(attributes: Attributes, name: str) -> float | None:
    """Return an attribute as a finite number, or None."""
    found = attribute_numbers(attributes, name)
    return found[0] if len(found) == 1 and math.isfinite(found[0]) else None


def attribute_numbers(attributes: Attributes, name: str) -> list[float]:
    """Return an attribute's numbers; empty if there are none."""
    try:
        value = attributes.get(name)
        return [] if value is None else [float(each) for each in np.ravel(value)[:64]]
    except Exception:
        # Attributes of types that the library does not know.
        return []


def attribute_text(attributes: Attributes, name: str) -> str:
    """Return an attribute as text, also if stored as letters; empty if missing."""
    try:
        value = attributes.get(name)
        if isinstance(value, np.ndarray):
            value = (
                b"".join(value.ravel().tolist()) if value.dtype.kind == "S" else value.ravel()[0]
            )
        return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")
    except Exception:
        return ""
