"""Sanity checks on what a volume file's header claims, made before any memory is taken."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike, NDArray

from model.errors import VolumeError
from model.scene.volume import Triple

AXES = "xyz"
SMALLEST_SPACING, LARGEST_SPACING = 1e-15, 1e15


def readable_size(count: int) -> str:
    """Write a number of bytes for people: ``"1.5 GiB"``."""
    size = float(count)
    for unit in ("bytes", "KiB", "MiB", "GiB", "TiB"):
        if size < 1024 or unit == "TiB":
            break
        size /= 1024
    return f"{count} bytes" if unit == "bytes" else f"{size:.1f} {unit}"


def times(dimensions: Sequence[int]) -> str:
    """Write dimensions for people: ``"256 x 256 x 110"``."""
    return " x ".join(str(n) for n in dimensions)


def physical_memory() -> int | None:
    """Bytes of memory in this machine; None where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return None


def check_grid(path: Path, dimensions: Sequence[int], dtype: DTypeLike, components: int = 1) -> int:
    """Check that a header describes a volume that this machine can hold.

    Parameters
    ----------
    path : Path
        Named in the message.
    dimensions : sequence of int
        Voxels along x, y and z, as the header has them.
    dtype : dtype-like
        Type of one component.
    components : int
        Values per voxel.

    Returns
    -------
    int
        Bytes that the voxels take.

    Raises
    ------
    VolumeError
        When a dimension is not positive, the image is flat, or the voxels
        need more than the machine's memory.
    """
    if any(n < 1 for n in dimensions) or components < 1:
        raise VolumeError(
            f"{path}: the header gives the dimensions {times(dimensions)}, which cannot be; "
            "the file is damaged or foreign."
        )
    if len(dimensions) < 3 or min(dimensions) < 2:
        raise VolumeError(
            f"{path}: this is a flat image of {times(dimensions)} pixels, not a volume; "
            "choose a file with at least two voxels along each of three axes."
        )
    if len(dimensions) > 3:
        raise VolumeError(
            f"{path}: the grid of {times(dimensions)} has {len(dimensions)} axes; "
            "save one time step or channel of it as a volume of three."
        )
    need = math.prod(dimensions) * components * np.dtype(dtype).itemsize
    memory = physical_memory()
    if memory is not None and need > memory:
        raise VolumeError(
            f"{path}: the header claims {times(dimensions)} voxels, {readable_size(need)}, "
            f"but this machine has {readable_size(memory)} of memory; "
            "crop or downsample the volume, or correct the header."
        )
    return need


def check_present(path: Path, present: int, need: int) -> None:
    """Raise VolumeError when fewer bytes of voxels are there than the header promises."""
    if present < need:
        raise truncated(
            path, f"it has {max(present, 0)} of the {need} bytes of voxels that its header promises"
        )


def truncated(path: Path, how: str) -> VolumeError:
    """Error for a file that ends too early; `how` says what is missing."""
    return VolumeError(f"{path}: the file is truncated ({how}); copy or download it again.")


def damaged(path: Path, how: str) -> VolumeError:
    """Error for a header or stream that makes no sense; `how` says which part."""
    return VolumeError(f"{path}: the file is damaged or foreign: {how}; check where it came from.")


def unsupported(path: Path, what: str, remedy: str) -> VolumeError:
    """Error for a valid file of a kind that is not read here."""
    return VolumeError(f"{path}: {what} cannot be read here; {remedy}.")


def usable_spacing(spacing: Sequence[float] | None) -> tuple[Triple, tuple[str, ...]]:
    """Turn a header's spacing into one that a volume can have.

    A sign only tells the direction of an axis and is dropped. What is missing,
    zero or not finite becomes 1.

    Returns
    -------
    spacing : tuple of float
    notes : tuple of str
        What was assumed, empty when nothing was.
    """
    if spacing is None:
        return (1.0, 1.0, 1.0), ("The file gives no voxel spacing; 1 is assumed.",)
    fixed = [
        float(abs(s)) if SMALLEST_SPACING < abs(s) < LARGEST_SPACING else None for s in spacing
    ]
    unknown = ", ".join(axis for axis, s in zip(AXES, fixed, strict=True) if s is None)
    notes = (f"The file's voxel spacing along {unknown} is unusable; 1 is assumed.",)
    x, y, z = (1.0 if s is None else s for s in fixed)
    return (x, y, z), notes if unknown else ()


def usable_origin(origin: Sequence[float]) -> Triple:
    """Replace what is not finite by 0."""
    x, y, z = (float(o) if math.isfinite(o) else 0.0 for o in origin)
    return x, y, z


def frame_notes(directions: NDArray[np.float64], handedness: int = 1) -> tuple[str, ...]:
    """Say how the grid's axes lie in the file's space when that is not the plain way.

    Parameters
    ----------
    directions : ndarray of float64, shape (3, 3)
        Row k is the step from one voxel to the next along the grid's axis k,
        in the file's space.
    handedness : int
        -1 when that space is left-handed.

    Returns
    -------
    tuple of str
        Notes for the user; volumes are always shown in index order.
    """
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    if not np.isfinite(directions).all() or not (lengths > 0).all():
        return ()
    unit = directions / lengths
    aligned = np.allclose(np.abs(unit).max(axis=1), 1.0, atol=1e-4)
    mirrored = np.linalg.det(unit) * handedness < 0
    notes = []
    if not aligned:
        notes.append("The grid lies oblique in the file's space; it is shown along its own axes.")
    elif not np.allclose(unit, np.eye(3), atol=1e-2) and not mirrored:
        notes.append("The grid is turned in the file's space; it is shown along its own axes.")
    if mirrored:
        notes.append("The grid is left-handed in the file's space, so it is shown mirrored.")
    return tuple(notes)
