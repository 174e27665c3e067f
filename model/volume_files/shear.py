"""Slices that are shifted against one another, or mirrored, put back to where they were taken."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

SQUARE = 1e-2
"""Cosine up to which two axes count as being at right angles."""

MOST_TILT, MOST_ROOM = 0.9, 2.0
"""Sine of the angle, and lengths of the slices by which they grow, up to which they are sheared."""


Shear = tuple[float, float]
"""Shift of each slice against the one before along x and y, in voxels."""


@dataclass(frozen=True, eq=False)
class Upright:
    """A grid whose slices lie behind one another, and which is not mirrored.

    Attributes
    ----------
    values : ndarray, shape (nz, ny, nx)
    missing : ndarray of bool, of the same shape, or None
    directions : ndarray of float64, shape (3, 3)
        Row k is the step from one voxel to the next along axis k.
    notes : tuple of str
        Empty if nothing was to be done.
    """

    values: NDArray[np.generic]
    missing: NDArray[np.bool_] | None
    directions: NDArray[np.float64]
    origin: tuple[float, float, float]
    notes: tuple[str, ...] = ()


def upright(
    values: NDArray[np.generic],
    directions: NDArray[np.float64],
    origin: tuple[float, float, float],
    handedness: int = 1,
) -> Upright:
    """Put a grid upright: neither mirrored in its space, nor sheared.

    The slices of a left-handed grid are read in reverse order. Where all are shifted by the same
    step against the one before, they are sheared back.

    Parameters
    ----------
    values : ndarray, shape (nz, ny, nx) or (nz, ny, nx, components)
        Components are not sheared.
    directions : ndarray of float64, shape (3, 3)
        Row k is the step from one voxel to the next along axis k, in the file's space.
    handedness : int
        -1 if the file's space is left-handed.
    """
    if not np.isfinite(directions).all() or np.linalg.det(directions) * handedness >= 0:
        return _sheared_back(values, directions, origin)
    x, y, z = (np.array(origin) + (values.shape[0] - 1) * directions[2]).tolist()
    found = _sheared_back(values[::-1], directions * [[1.0], [1.0], [-1.0]], (x, y, z))
    note = "The grid is left-handed, so its slices are read in reverse order."
    return replace(found, notes=(note, *found.notes))


def _sheared_back(
    values: NDArray[np.generic],
    directions: NDArray[np.float64],
    origin: tuple[float, float, float],
) -> Upright:
    """Shear a grid back whose slices are shifted against one another by the same step each."""
    x, y, z = directions
    lengths = np.linalg.norm(directions, axis=1)
    as_it_is = Upright(values, None, directions, origin)
    if values.ndim != 3 or not np.isfinite(directions).all() or not (lengths > 0).all():
        return as_it_is
    if abs(x @ y) > SQUARE * lengths[0] * lengths[1]:
        return as_it_is
    shear = float(z @ x / lengths[0] ** 2), float(z @ y / lengths[1] ** 2)
    tilt = np.hypot(shear[0] * lengths[0], shear[1] * lengths[1]) / lengths[2]
    more = max(map(abs, shear)) * values.shape[0]
    if not SQUARE < tilt < MOST_TILT or more > MOST_ROOM * max(values.shape[1:]):
        return as_it_is
    normal = np.cross(x, y) / (lengths[0] * lengths[1])
    moved_values, missing, moved = sheared_back(values, None, shear)
    first = np.array(origin) - moved[0] * x - moved[1] * y
    note = (
        f"The slices are shifted against one another by {np.degrees(np.arcsin(tilt)):.1f} degrees; "
        "they are sheared back to where they were taken."
    )
    return Upright(
        moved_values,
        missing,
        np.stack([x, y, (z @ normal) * normal]),
        (float(first[0]), float(first[1]), float(first[2])),
        (note,),
    )


def sheared_back(
    values: NDArray[np.generic], missing: NDArray[np.bool_] | None, shear: Shear
) -> tuple[NDArray[np.generic], NDArray[np.bool_], tuple[int, int]]:
    """Move each slice by its shift, within a grid that has room for all of them.

    Between voxels values are interpolated linearly; what lies in no slice is missing.

    Parameters
    ----------
    values : ndarray, shape (nz, ny, nx)
    missing : ndarray of bool, shape (nz, ny, nx), or None

    Returns
    -------
    values : ndarray, shape (nz, ny + more, nx + more)
        Of the same type.
    missing : ndarray of bool, of the same shape
    moved : tuple of int
        Voxels that the first slice has moved along x and y: the grid begins so many before it.
    """
    nz, ny, nx = values.shape
    more = [math.ceil(abs(step) * (nz - 1) - 1e-6) for step in shear]
    start = [count if step < 0 else 0 for count, step in zip(more, shear, strict=True)]
    shape = nz, ny + more[1], nx + more[0]
    moved, absent = np.zeros(shape, values.dtype), np.ones(shape, bool)
    for z in range(nz):
        x, y = start[0] + z * shear[0], start[1] + z * shear[1]
        plane, nothing = values[z], None if missing is None else missing[z]
        _place(moved[z], absent[z], plane, nothing, x, y)
    return moved, absent, (start[0], start[1])


def _place(
    target: NDArray[np.generic],
    absent: NDArray[np.bool_],
    plane: NDArray[np.generic],
    nothing: NDArray[np.bool_] | None,
    x: float,
    y: float,
) -> None:
    """Put a slice into a larger one at a place between its voxels."""
    known = np.ones(plane.shape, bool) if nothing is None else ~nothing
    pixels = plane.astype(np.float64)
    for axis, place in ((1, x), (0, y)):
        whole, rest = divmod(round(place, 6), 1)
        pixels, known = _shifted(pixels, known, axis, int(whole), rest, target.shape[axis])
    if target.dtype.kind in "iu":
        pixels = np.rint(pixels)
    target[...] = np.where(known, pixels, 0).astype(target.dtype)
    absent[...] = ~known


def _shifted(
    pixels: NDArray[np.float64],
    known: NDArray[np.bool_],
    axis: int,
    whole: int,
    rest: float,
    length: int,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Shift along an axis by `whole` voxels and a `rest` from 0 to 1, in `length` voxels."""
    shape = list(pixels.shape)
    shape[axis] = length + 1
    count = pixels.shape[axis]
    wide, there = np.zeros(shape), np.zeros(shape, bool)
    place = [slice(None), slice(None)]
    # One voxel of room before, for the neighbor of the first.
    room = shape[axis] - (whole + 1)
    kept = [slice(None), slice(None)]
    kept[axis] = slice(0, min(count, room))
    place[axis] = slice(whole + 1, whole + 1 + min(count, room))
    wide[tuple(place)], there[tuple(place)] = pixels[tuple(kept)], known[tuple(kept)]
    upper, lower = [slice(None), slice(None)], [slice(None), slice(None)]
    upper[axis], lower[axis] = slice(1, None), slice(0, -1)
    if rest == 0:
        return wide[tuple(upper)], there[tuple(upper)]
    mixed = (1 - rest) * wide[tuple(upper)] + rest * wide[tuple(lower)]
    return mixed, there[tuple(upper)] & there[tuple(lower)]
