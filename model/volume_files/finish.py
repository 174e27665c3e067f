"""Conversion of a file's grid to a volume: one component, finite values, a readable name."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.axes import axis_labelled
from model.scene.volume import Volume, is_resolved
from model.volume_files.grid import Grid

Component = int | Literal["magnitude"]

_LAYOUT_SUFFIX = re.compile(r"[\W_]*\d+x\d+x\d+([\W_].*)?$", re.IGNORECASE)


def make_volume(path: Path, grid: Grid, component: Component | None) -> Volume:
    """Convert a file's grid to a volume.

    Parameters
    ----------
    path : Path
        File or folder of the grid.
    grid : Grid
    component : int, "magnitude" or None
        The component to use; None if there is only one.

    Raises
    ------
    VolumeError
        When the component is missing or ambiguous, or no voxel is finite, or
        all are equal.
    """
    scalars = _one_component(path, grid.values, component)
    bad_notes = _replace_bad_voxels(path, scalars)
    scalars, offset_notes = _without_offset(scalars)
    try:
        return Volume(
            scalars,
            grid.spacing,
            grid.origin,
            readable_name(path),
            grid.units,
            grid.notes + bad_notes + offset_notes,
            axis_labelled("S", grid.axis_labels),
            grid.axis_labels,
        )
    except VolumeError as error:
        raise VolumeError(
            f"{path}: {str(error).removeprefix(readable_name(path) + ': ')}"
        ) from None


def _without_offset(
    scalars: NDArray[np.generic],
) -> tuple[NDArray[np.generic], tuple[str, ...]]:
    """Subtract the smallest voxel from integers that floating-point numbers would mix up."""
    if scalars.dtype.kind not in "iu" or scalars.dtype.itemsize < 8:
        return scalars, ()
    low, high = int(scalars.min()), int(scalars.max())
    if low == high or is_resolved((float(low), float(high))):
        return scalars, ()
    note = (
        f"All values are shown less {low}: so far from 0, floating-point numbers could not tell "
        "them apart."
    )
    less: NDArray[np.generic] = np.subtract(scalars, scalars.dtype.type(low))
    return less, (note,)


def readable_name(path: Path) -> str:
    """Return the file name as words, without its suffix and a trailing layout.

    ``engine_256x256x110_uint8.raw`` becomes ``engine``.
    """
    stem = path.name if path.is_dir() else re.sub(r"\.gz$", "", path.name, flags=re.IGNORECASE)
    stem = stem if path.is_dir() else Path(stem).stem
    words = _LAYOUT_SUFFIX.sub("", stem).replace("_", " ").strip()
    return words or stem or "volume"


def _one_component(
    path: Path, values: NDArray[np.generic], component: Component | None
) -> NDArray[np.generic]:
    """Reduce components to scalars, C-contiguous and without an unnecessary copy."""
    count = values.shape[3] if values.ndim == 4 else 1
    last = count - 1
    if component is None and count > 1:
        choices = f"0 to {last}"
        raise VolumeError(
            f"{path}: every voxel has {count} components; "
            f"choose one ({choices}) or their magnitude.",
            component="magnitude",
        )
    if component == "magnitude" and count > 1:
        return _magnitude(values)
    if isinstance(component, int) and not 0 <= component < count:
        raise VolumeError(
            f"{path}: there is no component {component}; "
            + (f"choose 0 to {last} or magnitude." if last else "the volume has one, number 0.")
        )
    if values.ndim == 4:
        values = values[..., component if isinstance(component, int) else 0]
    return np.ascontiguousarray(values)


def _magnitude(values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Euclidean norm of each voxel's components, computed slice by slice to save memory."""
    narrow = np.can_cast(values.dtype, np.float32)
    lengths = np.empty(values.shape[:3], np.float32 if narrow else np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        for plane, vectors in zip(lengths, values, strict=True):
            plane[:] = np.sqrt(np.square(vectors.astype(np.float64)).sum(axis=-1))
    return lengths


def _replace_bad_voxels(path: Path, scalars: NDArray[np.generic]) -> tuple[str, ...]:
    """Set NaN and infinite voxels to the smallest finite value, in place; return notes."""
    if scalars.dtype.kind != "f":
        return ()
    bad, lowest = 0, np.inf
    for plane in scalars:
        finite = np.isfinite(plane)
        bad += finite.size - int(np.count_nonzero(finite))
        lowest = min(lowest, float(plane.min(where=finite, initial=np.inf)))
    if bad == 0:
        return ()
    if bad == scalars.size:
        raise VolumeError(
            f"{path}: every voxel is NaN or infinite, so there is nothing to show; "
            "choose another file or component."
        )
    for plane in scalars:
        plane[~np.isfinite(plane)] = lowest
    noun = "voxel was" if bad == 1 else "voxels were"
    return (f"{bad} NaN or infinite {noun} set to the minimum, {lowest:g}.",)
