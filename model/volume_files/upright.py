"""Grids put where they lie: not mirrored, and with slices behind one another."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.volume import Triple
from model.volume_files.frame import unit_directions, unmirrored, usable_origin, usable_spacing

SQUARE = 1e-2
"""Cosine up to which two axes count as being at right angles."""

MOST_TILT, MOST_ROOM = 0.9, 2.0
"""Sine of the angle, and lengths of the slices by which they grow, up to which they are sheared."""

Shear = tuple[float, float]
"""Shift of each slice against the one before along x and y, in voxels."""


@dataclass(frozen=True, eq=False)
class Placed:
    """A grid whose slices lie behind one another, and which is not mirrored.

    Row k of the directions is the step from one voxel to the next along axis k; None if unknown.
    """

    values: NDArray[np.generic]
    missing: NDArray[np.bool_] | None
    spacing: Triple
    origin: Triple
    directions: NDArray[np.float64] | None
    notes: tuple[str, ...]


def placed(
    values: NDArray[np.generic],
    steps: Sequence[float | None] | None,
    origin: Sequence[float],
    directions: NDArray[np.float64] | None = None,
    handedness: int = 1,
    missing: NDArray[np.bool_] | None = None,
) -> Placed:
    """Put a grid where its file says it lies.

    Axes with negative steps and the slices of a left-handed grid are read in reverse order. Where
    all slices are shifted by the same step against the one before, they are sheared back; not those
    of components. Row k of the directions points along axis k, with any length. The handedness is
    -1 if the file's space is left-handed.
    """
    spacing, notes = usable_spacing(steps)
    unit = unit_directions(directions)
    rows = np.array(unit) if unit else None
    values, place, mirror_notes = unmirrored(values, steps or (), origin, rows)
    if missing is not None:
        missing, _, _ = unmirrored(missing, steps or (), origin)  # type: ignore[assignment]
    notes = mirror_notes + notes
    if rows is None:
        return Placed(values, missing, spacing, usable_origin(place), None, notes)
    axes = rows * np.array(spacing)[:, None]
    if np.linalg.det(axes) * handedness < 0:
        place = usable_origin((np.array(place) + (values.shape[0] - 1) * axes[2]).tolist())
        values, missing = values[::-1], None if missing is None else missing[::-1]
        axes = axes * [[1.0], [1.0], [-1.0]]
        notes += ("The grid is left-handed, so its slices are read in reverse order.",)
    upright = Placed(values, missing, spacing, place, axes, notes)
    return _sheared_back(upright, axes)


def _sheared_back(grid: Placed, directions: NDArray[np.float64]) -> Placed:
    """Shear a grid back whose slices are shifted against one another by the same step each."""
    x, y, z = directions
    lengths = np.linalg.norm(directions, axis=1)
    if grid.values.ndim != 3 or abs(x @ y) > SQUARE * lengths[0] * lengths[1]:
        return grid
    shear = float(z @ x / lengths[0] ** 2), float(z @ y / lengths[1] ** 2)
    tilt = np.hypot(shear[0] * lengths[0], shear[1] * lengths[1]) / lengths[2]
    more = max(map(abs, shear)) * grid.values.shape[0]
    if not SQUARE < tilt < MOST_TILT or more > MOST_ROOM * max(grid.values.shape[1:]):
        return grid
    normal = np.cross(x, y) / (lengths[0] * lengths[1])
    values, missing, moved = sheared_back(grid.values, grid.missing, shear)
    upright = np.stack([x, y, (z @ normal) * normal])
    note = (
        f"The slices are shifted against one another by {np.degrees(np.arcsin(tilt)):.1f} degrees; "
        "they are sheared back to where they were taken."
    )
    return Placed(
        values,
        missing,
        usable_spacing(np.linalg.norm(upright, axis=1).tolist())[0],
        usable_origin((np.array(grid.origin) - moved[0] * x - moved[1] * y).tolist()),
        upright,
        (*grid.notes, note),
    )


def sheared_back(
    values: NDArray[np.generic], missing: NDArray[np.bool_] | None, shear: Shear
) -> tuple[NDArray[np.generic], NDArray[np.bool_], tuple[int, int]]:
    """Move each slice by its shift, within a grid that has room for all of them.

    Between voxels values are interpolated linearly; what lies in no slice is missing. Returns
    values, missing voxels, and how many voxels before the first slice the grid begins along x and
    y.
    """
    from scipy.ndimage import affine_transform

    nz, ny, nx = values.shape
    more = [math.ceil(abs(step) * (nz - 1) - 1e-6) for step in shear]
    start = [count if step < 0 else 0 for count, step in zip(more, shear, strict=True)]
    shape = nz, ny + more[1], nx + more[0]
    moved, absent = np.zeros(shape, values.dtype), np.ones(shape, bool)
    for z, plane in enumerate(values):
        places = [-round(start[k] + z * shear[k], 6) for k in (1, 0)]
        known = np.ones(plane.shape) if missing is None else (~missing[z]).astype(float)
        pixels, there = (
            affine_transform(each, (1.0, 1.0), places, shape[1:], order=1)
            for each in (plane.astype(np.float64), known)
        )
        # Where a voxel has all the neighbors that it lies between.
        absent[z] = there < 1 - 1e-6
        pixels = np.rint(pixels) if values.dtype.kind in "iu" else pixels
        moved[z] = np.where(absent[z], 0, pixels).astype(values.dtype)
    return moved, absent, (start[0], start[1])
