"""Planes of the crop box as people read them: as voxels along named axes."""

from __future__ import annotations

from model.scene.crop import LEAST_LENGTH

WITHOUT_VOLUME = (2, 2, 2)
"""Dimensions before a volume is opened; nothing can be cropped off these."""


def voxel_at(place: float, count: int) -> int:
    """Return the voxel nearest to a plane, given as a fraction of the volume, from 0."""
    return round(place * (count - 1))


def place_of(voxel: int, count: int) -> float:
    """Return a plane through a voxel's center, as a fraction of the volume."""
    return voxel / (count - 1)


def least_length(count: int) -> float:
    """Return the shortest side of a crop box, as a fraction: one voxel, or what a box needs."""
    return max(LEAST_LENGTH, 1 / (count - 1))


def axis_name(axis: int, labels: tuple[str, ...]) -> str:
    """Return the name of axis 0, 1 or 2, with the patient's directions at its ends if known."""
    upper, lower = labels[2 * axis : 2 * axis + 2] or ("", "")
    return f"{'xyz'[axis]} ({lower}–{upper})" if lower else "xyz"[axis]
