"""Pictures of a headerless file under a layout, and whether the layout fits the file."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.volume_files.checks import readable_size, times, unreadable
from model.volume_files.raw import LONGEST_HEADER, RawLayout

PREVIEW_SIZE = 256
"""Most pixels of a preview along either side."""

PERCENTILES = 1.0, 99.0
"""Percentiles of the slice's values that are shown black and white."""


def preview(path: Path, layout: RawLayout, axis: int) -> NDArray[np.uint8]:
    """Return a picture of the middle slice across an axis, from no more of the file than it needs.

    Voxels that the file lacks are black. At most 256 pixels along each side; columns run along x,
    or along y in a slice across x; rows run along y, or along z from the bottom upwards.
    """
    try:
        values, usable = _slice(path, layout, axis)
    except OSError as error:
        raise unreadable(path, error) from None
    return _gray(values, usable)


def file_size(path: Path) -> int:
    """Return the bytes of a file; raise VolumeError if there is none."""
    try:
        return path.stat().st_size
    except OSError as error:
        raise unreadable(path, error) from None


def _slice(
    path: Path, layout: RawLayout, axis: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Read a middle slice: its values, and where they are there and finite."""
    places: list[NDArray[np.int64]] = [
        np.arange(0, n, max(math.ceil(n / PREVIEW_SIZE), 1)) for n in layout.dimensions
    ]
    places[axis] = np.array([layout.dimensions[axis] // 2])
    x, y, z = places
    nx, ny, _ = layout.dimensions
    voxels = (z[:, None, None] * ny + y[:, None]) * nx + x
    plane = np.squeeze(voxels, axis=2 - axis)
    if axis != 2:
        plane = plane[::-1]
    present = max(path.stat().st_size - layout.offset, 0) // layout.dtype.itemsize
    if present == 0:
        return np.zeros(plane.shape), np.zeros(plane.shape, np.bool_)
    values = np.memmap(path, layout.dtype, "r", layout.offset, (present,))
    inside = plane < present
    with np.errstate(invalid="ignore", over="ignore"):
        shown = np.asarray(values[np.where(inside, plane, 0)]).astype(np.float64)
    return shown, inside & np.isfinite(shown)


def _gray(values: NDArray[np.float64], usable: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Scale values between percentiles to 0..255; what is not usable is black."""
    if not usable.any():
        return np.zeros(values.shape, np.uint8)
    low, high = np.percentile(values[usable], PERCENTILES)
    if low == high:
        # Few voxels differ from the background: show those.
        low, high = values[usable].min(), values[usable].max()
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        unit = np.clip(values / 2 - low / 2, 0, None) / (high / 2 - low / 2)
    unit = np.where(usable, np.nan_to_num(unit, posinf=1.0), 0.0)
    return np.rint(255 * np.clip(unit, 0.0, 1.0)).astype(np.uint8)


def fit_sentence(layout: RawLayout, present: int) -> str:
    """Say how many bytes a layout needs against what the file has, and what would fit."""
    need = layout.nbytes
    what = f"{times(layout.dimensions)} voxels of {layout.scalar_type} need {_bytes(need)}"
    if layout.offset:
        what = what.replace(" need ", f" behind {layout.offset:,} bytes need ")
    if need == present:
        return f"{what}, which is what the file has."
    gap = f"{abs(need - present):,} bytes {'too few' if present < need else 'too many'}"
    if remedies := _remedies(layout, present):
        advice = f" It would fit with {', or '.join(remedies)}."
    elif 0 < present - need <= LONGEST_HEADER:
        skip = layout.offset + present - need
        advice = f" A header? It would fit with {skip:,} bytes skipped."
    else:
        advice = ""
    return f"{what}; the file has {_bytes(present)}, {gap}.{advice}"


def _bytes(count: int) -> str:
    size = readable_size(count)
    return f"{count:,} bytes" if "bytes" in size else f"{count:,} bytes ({size})"


def _remedies(layout: RawLayout, present: int) -> list[str]:
    """Return the single changes of a layout that make it fit."""
    found: list[str] = []
    voxels = math.prod(layout.dimensions)
    present -= layout.offset
    if present <= 0:
        return []
    size, rest = divmod(present, voxels)
    if not rest:
        # One common type of each size is enough to say how wide the values are.
        common = ("uint8", "uint16", "float32", "float64")
        found += [name for name in common if np.dtype(name).itemsize == size]
    for axis in (2, 1, 0):
        others = voxels // layout.dimensions[axis] * layout.dtype.itemsize
        count, rest = divmod(present, others)
        if not rest and count > 1:
            found.append(f"{count:,} voxels along {'xyz'[axis]}")
    return found
