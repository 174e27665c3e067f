"""Grids, which file readers return, and their placement: spacing, units and directions."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.slices import OPPOSITES
from model.scene.volume import Caution, FileFacts, Triple
from model.volume_files.checks import number_of


@dataclass(frozen=True, eq=False)
class Grid:
    """Voxels of a file, with one or more components, along x, y and z.

    Values have any real type, native byte order and shape (nz, ny, nx) or (nz, ny, nx, components).
    NaN, infinities and `missing` (nz, ny, nx) were not measured. `up` points up where no patient's
    axes do.
    """

    values: NDArray[np.generic]
    spacing: Triple = (1.0, 1.0, 1.0)
    origin: Sequence[float] = (0.0, 0.0, 0.0)
    units: str = ""
    notes: tuple[str, ...] = ()
    axis_labels: tuple[str, ...] = ()
    up: str = ""
    missing: NDArray[np.bool_] | None = None
    facts: FileFacts = field(default=FileFacts())


AXES = "xyz"
SMALLEST_SPACING, LARGEST_SPACING = 1e-15, 1e15
MOST_UNLIKE_SPACING = 1e4
MOST_STRETCHED = 1e9

HEIGHTS = 0.2, 1.0  # limits of a box's height relative to its width if units differ

_UNITS = {
    **{"m meter meters metre metres": 1.0, "dm decimeter": 1e-1},
    **{"cm centimeter centimeters centimetre": 1e-2, "nm nanometer nanometers nanometre": 1e-9},
    "mm millimeter millimeters millimetre millimetres": 1e-3,
    "um micron microns micrometer micrometers micrometre": 1e-6,
    **{"pm picometer picometre": 1e-12, "angstrom a angstroms \u00e5 \u212b": 1e-10},
    **{'inch in inches "': 0.0254, "km kilometer kilometre": 1e3},
}
METRES = {name: length for names, length in _UNITS.items() for name in names.split()}
NAMES = {length: names.split()[0] for names, length in _UNITS.items()}  # their usual ones


def unit_name(text: str) -> str:
    """Return a unit's usual name: ``"um"`` for ``"micron"``; unknown ones unchanged."""
    if text.lower().startswith("degree"):
        return "degrees"
    word = text.strip().strip("\0").replace("\\u00B5", "u").replace("\u00b5", "u")
    word = word.replace("\u03bc", "u")
    length = METRES.get(word.lower())
    return word if length is None else NAMES[length]


def typed_spacing(text: str) -> tuple[Triple, str]:
    """Parse a spacing along x, y and z and its unit, such as ``"0.5,0.5,2 um"``."""
    numbers, _, unit = text.strip().replace(", ", ",").partition(" ")
    steps = [number_of(word) or 0.0 for word in numbers.split(",")]
    if len(steps) != 3 or not all(SMALLEST_SPACING < step < LARGEST_SPACING for step in steps):
        raise VolumeError(
            f"'{text}' is not a voxel spacing; give three numbers above 0 along x, y and z, and "
            "their unit if it is known, such as 0.5,0.5,2 or '0.5,0.5,2 um'."
        )
    return (steps[0], steps[1], steps[2]), unit_name(unit)


def typed_stretch(text: str) -> float:
    """Parse the factor by which z is stretched."""
    factor = number_of(text) or 0.0
    if not 1 / MOST_STRETCHED <= factor <= MOST_STRETCHED:
        raise VolumeError(
            f"'{text}' is not a stretch of z; give a factor, such as 20, or 1 for none."
        )
    return factor


def in_one_unit(
    lengths: Sequence[float | None], units: Sequence[str]
) -> tuple[list[float | None], str, tuple[str, ...]]:
    """Convert lengths to the first one's unit; also return it, and a note if units differ."""
    names = [unit_name(unit) for unit in units]
    known = [name for name, length in zip(names, lengths, strict=True) if length is not None]
    unit = known[0] if known else ""
    if all(name == unit for name in known):
        return list(lengths), unit, ()
    if any(name.lower() not in METRES for name in known):
        note = f"{_differing(names)}; they are taken as one."
        return list(lengths), "", (note,)
    scale = METRES[unit.lower()]
    converted = [
        None if length is None else float(length * METRES[name.lower()] / scale)
        for name, length in zip(names, lengths, strict=True)
    ]
    return converted, unit, ()


def _differing(units: Sequence[str]) -> str:
    return f"The units of the axes differ ({', '.join(unit or 'none' for unit in units)})"


def proposed_stretch(
    lengths: Sequence[float | None], dimensions: Sequence[int], units: Sequence[str]
) -> tuple[float, str]:
    """Propose a stretch of z, whose unit differs from that of x and y, with a note."""
    differ = _differing([unit_name(unit) for unit in units])
    x, y, z = (abs(length or 0.0) * (n - 1) for length, n in zip(lengths, dimensions, strict=True))
    widest = max(x, y)
    if not z or not widest or HEIGHTS[0] <= z / widest <= HEIGHTS[1]:
        return 1.0, f"{differ}; they are taken as one."
    height = min(max(z / widest, HEIGHTS[0]), HEIGHTS[1])
    stretch = height * widest / z
    return stretch, (
        f"{differ}: z is drawn {stretch:.3g} times as long as its numbers say, so that its height "
        f"is {height:.0%} of its width."
    )


def usable_spacing(spacing: Sequence[float | None] | None) -> tuple[Triple, tuple[str, ...]]:
    """Convert a header's spacing, or None, to a valid one; also return notes.

    Signs are dropped, see :func:`placed`; unusable steps become 1, and all if they are very unlike.
    """
    ones = (1.0, 1.0, 1.0)
    if spacing is None or all(s is None for s in spacing):
        return ones, ("The file gives no voxel spacing; 1 is assumed.",)
    steps = [*zip(AXES, spacing, strict=True)]
    usable = {k for k, s in steps if s is not None and SMALLEST_SPACING < abs(s) < LARGEST_SPACING}
    first = next((abs(float(s)) for k, s in steps if s and k in usable), 1.0)
    x, y, z = (first if s is None else abs(float(s)) if k in usable else 1.0 for k, s in steps)
    if max(x, y, z) > MOST_UNLIKE_SPACING * min(x, y, z):
        sizes = f"{x:g} x {y:g} x {z:g}"
        return ones, (f"The file's voxel spacing of {sizes} is unusable; 1 is assumed.",)
    silent = ", ".join(k for k, s in steps if s is None)
    unknown = ", ".join(k for k, s in steps if s is not None and k not in usable)
    notes: tuple[str, ...] = ()
    if silent:
        notes += (
            f"The file gives no voxel spacing along {silent}; {first:g} is assumed, as along the "
            "others.",
        )
    if unknown:
        notes += (f"The file's voxel spacing along {unknown} is unusable; 1 is assumed.",)
    return (x, y, z), notes


def usable_origin(origin: Sequence[float]) -> Triple:
    """Replace coordinates that are not finite by 0."""
    x, y, z = (float(o) if math.isfinite(o) else 0.0 for o in origin)
    return x, y, z


def unit_directions(directions: NDArray[np.float64] | None) -> tuple[Triple, ...]:
    """Return the rows of a matrix as unit vectors; empty if they are unusable."""
    if directions is None or not np.isfinite(directions).all():
        return ()
    lengths = np.linalg.norm(directions, axis=1, keepdims=True)
    if not (lengths > 0).all():
        return ()
    # Without -0.0.
    return tuple((float(x), float(y), float(z)) for x, y, z in directions / lengths + 0.0)


def frame_notes(directions: NDArray[np.float64]) -> tuple[str, ...]:
    """Describe the orientation of the grid in the file's space, unless it is the default."""
    unit = np.array(unit_directions(directions))
    if not unit.size:
        return ()
    if not np.allclose(unit @ unit.T, np.eye(3), atol=1e-2):
        return (
            "The grid's axes are not at right angles in the file's space; it is shown as if they "
            "were, so its shape is wrong: resample it in the program that made it.",
        )
    if not np.allclose(np.abs(unit).max(axis=1), 1.0, atol=1e-4):
        return ("The grid lies oblique in the file's space; it is shown along its own axes.",)
    if not np.allclose(unit, np.eye(3), atol=1e-2):
        return ("The grid is turned in the file's space; it is shown along its own axes.",)
    return ()


def axis_labels(directions: NDArray[np.float64] | None, space: str) -> tuple[str, ...]:
    """Name the patient's directions that +x, -x, +y, -y, +z and -z of a grid are closest to.

    Row k of `directions` is the step along axis k in a space such as ``"LPS"``.
    """
    unit = np.array(unit_directions(directions))
    if not unit.size or not is_space(space):
        return ()
    # Oblique grids: all three axes together, so that no two get the same name.
    order = max(
        itertools.permutations(range(3)),
        key=lambda axes: sum(abs(unit[k, axis]) for k, axis in enumerate(axes)),
    )
    labels: list[str] = []
    for k, axis in enumerate(order):
        label = space[axis] if unit[k, axis] > 0 else OPPOSITES[space[axis]]
        labels += [label, OPPOSITES[label]]
    return tuple(labels)


def is_space(letters: str) -> bool:
    """Return True for three letters that name one direction of each pair, such as ``"LPS"``."""
    pairs = ["RL", "AP", "SI"]
    return len(letters) == 3 and all(sum(each in pair for each in letters) == 1 for pair in pairs)


SQUARE = 1e-2  # cosine up to which two axes count as perpendicular
MOST_TILT, MOST_ROOM = 0.9, 2.0
"""Limits of shearing: sine of the angle, and growth in lengths of the slices."""

Shear = tuple[float, float]  # shift of a slice from the previous one along x and y, in voxels


def placed(
    grid: Grid,
    steps: Sequence[float | None] | None,
    directions: NDArray[np.float64] | None = None,
    space: str = "",
    *,
    is_left_handed: bool = False,
) -> Grid:
    """Place a grid as its file says, given its origin, and describe changes.

    Row k of the directions points along axis k, with any length, in a space such as ``"LPS"``,
    which may be left-handed. Axes with negative steps and slices of left-handed grids are reversed;
    evenly shifted slices of scalars are sheared back.
    """
    spacing, notes = usable_spacing(steps)
    unit = unit_directions(directions)
    axes = (np.array(unit) if unit else np.eye(3)) * np.array(spacing)[:, None]
    reversed_axes = [
        k
        for k, step in enumerate(steps or ())
        if step is not None and -LARGEST_SPACING < step < -SMALLEST_SPACING
    ]
    for k in reversed_axes:
        grid = _reversed(grid, k, -axes[k])
    if reversed_axes:
        names = ", ".join(AXES[k] for k in reversed_axes)
        mirrored = (
            f"The file's voxel spacing along {names} is negative, which mirrors the volume; "
            f"{names} {'is' if len(reversed_axes) == 1 else 'are'} read in reverse order, so that "
            "it is shown as it is."
        )
        notes = (mirrored, *notes)
    if unit and (np.linalg.det(axes) < 0) != is_left_handed:
        grid = _reversed(grid, 2, axes[2])
        axes = axes * [[1.0], [1.0], [-1.0]]
        notes += ("The grid is left-handed, so its slices are read in reverse order.",)
    origin = usable_origin(grid.origin)
    grid = replace(grid, spacing=spacing, origin=origin, notes=grid.notes + notes)
    if not unit:
        return grid
    grid, axes = _sheared_back(grid, axes)
    facts = replace(grid.facts, directions=unit_directions(axes), space=space)
    # Scanners write upright grids in RAS in two ways: x and y both positive, or both negative.
    is_turned_twice = space == "RAS" and axes[0, 0] < 0 and axes[1, 1] < 0
    turned = frame_notes(axes * (-1.0, -1.0, 1.0) if is_turned_twice else axes)
    labels = axis_labels(axes, space)
    return replace(grid, axis_labels=labels, notes=grid.notes + turned, facts=facts)


def _reversed(grid: Grid, axis: int, step: NDArray[np.float64]) -> Grid:
    """Return a grid with one axis in reverse order; its voxels are a step apart."""
    values, missing = (
        None if each is None else np.flip(each, axis=2 - axis)
        for each in (grid.values, grid.missing)
    )
    assert values is not None
    x, y, z = (float(o) for o in grid.origin + (values.shape[2 - axis] - 1) * step)
    return replace(grid, values=values, missing=missing, origin=(x, y, z))


def _sheared_back(grid: Grid, directions: NDArray[np.float64]) -> tuple[Grid, NDArray[np.float64]]:
    """Shear a grid back whose slices are each shifted by the same step."""
    x, y, z = directions
    lengths = np.linalg.norm(directions, axis=1)
    if grid.values.ndim != 3 or abs(x @ y) > SQUARE * lengths[0] * lengths[1]:
        return grid, directions
    shear = float(z @ x / lengths[0] ** 2), float(z @ y / lengths[1] ** 2)
    tilt = np.hypot(shear[0] * lengths[0], shear[1] * lengths[1]) / lengths[2]
    more = max(map(abs, shear)) * grid.values.shape[0]
    if not SQUARE < tilt < MOST_TILT or more > MOST_ROOM * max(grid.values.shape[1:]):
        return grid, directions
    normal = np.cross(x, y) / (lengths[0] * lengths[1])
    values, missing, moved = sheared_back(grid.values, grid.missing, shear)
    upright = np.stack([x, y, (z @ normal) * normal])
    note = Caution(
        f"The slices are shifted against one another by {np.degrees(np.arcsin(tilt)):.1f} degrees, "
        "as by a tilted gantry; they are sheared back to where they were taken."
    )
    spacing, _ = usable_spacing(np.linalg.norm(upright, axis=1).tolist())
    origin = usable_origin((np.array(grid.origin) - moved[0] * x - moved[1] * y).tolist())
    grid = replace(grid, values=values, missing=missing, spacing=spacing, origin=origin)
    return replace(grid, notes=(*grid.notes, note)), upright


def sheared_back(
    values: NDArray[np.generic], missing: NDArray[np.bool_] | None, shear: Shear
) -> tuple[NDArray[np.generic], NDArray[np.bool_], tuple[int, int]]:
    """Move each slice by its shift, within a grid large enough for all."""
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
        # Where a voxel has all the neighbors it lies between.
        absent[z] = there < 1 - 1e-6
        pixels = np.rint(pixels) if values.dtype.kind in "iu" else pixels
        moved[z] = np.where(absent[z], 0, pixels).astype(values.dtype)
    return moved, absent, (start[0], start[1])
