"""Conversion of a file's grid to a volume: one component, what is missing, a readable name."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.distribution import Distribution
from model.scene.filling import fill
from model.scene.orientation import line_distance
from model.scene.view import axis_labelled
from model.scene.volume import Content, Volume, is_resolved
from model.volume_files.checks import times
from model.volume_files.choice import LARGEST, Choice, choice_notes, content
from model.volume_files.grid import Grid, typed_spacing, typed_stretch, usable_origin
from model.volume_files.label_names import distinct_labels

Component = int | Literal["magnitude"]

MOST_IN_MAGNITUDE = 4  # components up to which a voxel's are taken for a vector or a colour
LEAST_SHARE, FEWEST = 0.001, 8  # of the voxels, from which a value counts as repeated

FAR, TAIL = 4.0, 0.001
"""Least distance of a value that is far from all others, in widths of their range, and the share
of them at each end that this range leaves out."""

ONLY_COMPONENT = "the volume has one, number 0."
FEWEST_OTHERS = 16  # different values that the others must have: labels have no fill value

_LAYOUT_SUFFIX = re.compile(r"[\W_]*\d+x\d+x\d+([\W_].*)?$", re.IGNORECASE)


def component_of(text: str | None) -> Component | None:
    """Return a component by its number or name; None stays None."""
    if text is None or text == "magnitude":
        return cast(Component | None, text)
    if not (text.isascii() and text.isdecimal() and len(text) < 10):
        raise VolumeError(f"'{text}' is not a component; give magnitude, or a number from 0.")
    return int(text)


def make_volume(path: Path, grid: Grid, choice: Choice = LARGEST) -> Volume:
    """Convert the grid of a file or folder to a volume."""
    grid = finished(path, grid, component_of(choice.component))
    if choice.spacing is not None or choice.stretch is not None:
        grid = _as_typed(grid, choice)
    if grid.facts.is_labels:
        grid = distinct_labels(grid)
    sizes = grid.values.shape[2::-1]
    lengths = [n * step for n, step in zip(sizes, grid.spacing, strict=True)]
    if line_distance(lengths) is not None:
        _, middle, longest = sorted(lengths)
        note = (
            f"The volume of {times(sizes)} voxels is {longest / middle:.0f} times as long as it is "
            "wide, and would be a thin line; the first view is of its middle."
        )
        grid = replace(grid, notes=(*grid.notes, note))
    values = grid.values if grid.missing is None else fill(grid.values, grid.missing)
    try:
        return Volume(
            values,
            grid.spacing,
            usable_origin(grid.origin),
            readable_name(path),
            grid.units,
            grid.notes,
            grid.up or axis_labelled("S", grid.axis_labels),
            grid.axis_labels,
            file=grid.facts,
            missing=grid.missing,
        )
    except VolumeError as error:
        error.args = (f"{path}: {str(error).removeprefix(readable_name(path) + ': ')}",)
        raise


def _as_typed(grid: Grid, choice: Choice) -> Grid:
    """Return a grid with spacing and stretch that were typed, and without notes on the file's."""
    facts, (x, y, z) = grid.facts, grid.spacing
    own, unit, stretch = (x, y, z / facts.stretch), facts.spacing_unit, facts.stretch
    assumed = re.compile(r"voxel spacing.*(assumed|unusable)|units of the axes differ")
    notes = [note for note in grid.notes if not assumed.search(note)]
    if choice.spacing is not None:
        is_own = not any("voxel spacing" in note and assumed.search(note) for note in grid.notes)
        file_has = " x ".join(f"{step:g}" for step in own) if is_own else "none that can be used"
        notes.append(f"The voxel spacing was typed; the file has {file_has}.")
        own, typed_unit = typed_spacing(choice.spacing)
        unit, stretch = typed_unit or unit, 1.0
    if choice.stretch is not None:
        stretch = typed_stretch(choice.stretch)
    if choice.stretch is not None and stretch != 1.0:
        notes.append(f"z is drawn {stretch:g} times as long as its spacing says, as you typed.")
    return replace(
        grid,
        spacing=(own[0], own[1], own[2] * stretch),
        origin=(*grid.origin[:2], grid.origin[2] * stretch / facts.stretch),
        notes=tuple(notes),
        facts=replace(facts, spacing_unit=unit, stretch=stretch),
    )


def finished(path: Path, grid: Grid, component: Component | None) -> Grid:
    """Reduce a grid to finite scalars; missing voxels get the others' smallest value."""
    scalars, listed, component_notes = _one_component(path, grid, component)
    scalars, missing, missing_notes = _without_missing(path, scalars, grid.missing)
    scalars, offset_notes = _without_offset(scalars)
    facts = replace(grid.facts, contents=grid.facts.contents + listed)
    notes = choice_notes(grid.facts.contents) + grid.notes
    notes += component_notes + missing_notes + offset_notes
    return replace(grid, values=scalars, missing=missing, facts=facts, notes=notes)


def _without_offset(scalars: NDArray[np.generic]) -> tuple[NDArray[np.generic], tuple[str, ...]]:
    """Subtract the smallest voxel from integers too large for distinct floats."""
    if scalars.dtype.kind not in "iu" or scalars.dtype.itemsize < 8:
        return scalars, ()
    low, high = int(scalars.min()), int(scalars.max())
    if low == high or is_resolved((float(low), float(high))):
        return scalars, ()
    note = (
        f"{low} is subtracted from all values: so far from 0, floating-point numbers could not "
        "tell them apart."
    )
    less: NDArray[np.generic] = np.subtract(scalars, scalars.dtype.type(low))
    return less, (note,)


def readable_name(path: Path) -> str:
    """Return ``engine`` for ``engine_256x256x110_uint8.raw``: the name without the layout."""
    stem = re.sub(r"(\.ome)?\.zarr$|\.gz$", "", path.name, flags=re.IGNORECASE)
    stem = stem if path.is_dir() else Path(stem).stem.removesuffix(".ome")
    words = _LAYOUT_SUFFIX.sub("", stem).replace("_", " ").strip()
    return words or stem or "volume"


def _one_component(
    path: Path, grid: Grid, component: Component | None
) -> tuple[NDArray[np.generic], tuple[Content, ...], tuple[str, ...]]:
    """Reduce components to a scalar, by default their magnitude or the first; add notes."""
    values = grid.values if grid.values.ndim == 4 else grid.values[..., None]
    count, notes = values.shape[3], tuple[str, ...]()
    if component is None and count > 1:
        is_vector = count <= MOST_IN_MAGNITUDE and not grid.facts.is_labels
        component = "magnitude" if is_vector else 0
        what = "their magnitude is read" if is_vector else "component 0 is read"
        notes = (
            f"Every voxel has {count} components; {what}, and 0 to {count - 1} can be chosen.",
        )
    if isinstance(component, int) and component >= count:
        there = f"choose 0 to {count - 1} or magnitude." if count > 1 else ONLY_COMPONENT
        raise VolumeError(f"{path}: there is no component {component}; {there}")
    if component == "magnitude" and count > 1:
        scalars = _magnitude(values)
    else:
        number = component if isinstance(component, int) else 0
        scalars = _in_order_of_slices(values[..., number])
    names = [*map(str, range(count)), "magnitude"] if count > 1 else []
    types = {"magnitude": _magnitude_type(values.dtype)}
    listed = (
        content(
            "component",
            name,
            scalars.shape[::-1],
            types.get(name, values.dtype),
            name == str(component),
        )
        for name in names
    )
    return scalars, tuple(listed), notes


def _in_order_of_slices(values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Return the values C-contiguous; reversed slices are swapped in place."""
    backwards = values[::-1]
    if not (backwards.flags.c_contiguous and backwards.flags.writeable) or len(values) < 2:
        return np.ascontiguousarray(values)
    for near in range(len(values) // 2):
        far = len(values) - 1 - near
        kept = backwards[near].copy()
        backwards[near] = backwards[far]
        backwards[far] = kept
    return backwards


def _magnitude(values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Euclidean norm of each voxel's components, computed slice by slice to save memory."""
    lengths = np.empty(values.shape[:3], _magnitude_type(values.dtype))
    with np.errstate(invalid="ignore", over="ignore"):
        for plane, vectors in zip(lengths, values, strict=True):
            plane[:] = np.sqrt(np.square(vectors.astype(np.float64)).sum(axis=-1))
    return lengths


def _magnitude_type(dtype: np.dtype[np.generic]) -> np.dtype[np.generic]:
    return np.dtype(np.float32 if np.can_cast(dtype, np.float32) else np.float64)


def _without_missing(
    path: Path, scalars: NDArray[np.generic], missing: NDArray[np.bool_] | None
) -> tuple[NDArray[np.generic], NDArray[np.bool_] | None, tuple[str, ...]]:
    """Find all voxels that are missing, and give them the smallest value of the others."""
    notes: tuple[str, ...] = ()
    declared = 0 if missing is None else int(np.count_nonzero(missing))
    if scalars.dtype.kind == "f" and not all(np.isfinite(plane).all() for plane in scalars):
        bad: NDArray[np.bool_] = ~np.isfinite(scalars)
        count = int(np.count_nonzero(bad))
        noun = "voxel is" if count == 1 else "voxels are"
        notes += (f"{count} {noun} NaN or infinite.",)
        missing = bad if missing is None else missing | bad
    if declared:
        notes += (f"The file marks {declared} voxels as missing.",)
    missing = missing if missing is not None and missing.any() else None
    if missing is not None and missing.all():
        raise VolumeError(
            f"{path}: every voxel is NaN or infinite, or marked as missing by the file, so there "
            "is nothing to show; choose another file or component."
        )
    distribution = Distribution(scalars, missing)
    for value in suspected_fills(distribution):
        notes += (
            f"{value:g} lies far from all other values, and many voxels have it: perhaps nothing "
            "was measured there. The file does not say so; the range of values can leave it out.",
        )
    if missing is not None:
        scalars = scalars if scalars.flags.writeable else scalars.copy()
        np.copyto(scalars, distribution.ends[0], where=missing)
    return scalars, missing, notes


def suspected_fills(distribution: Distribution) -> list[float]:
    """Return the lowest and the highest value if repeated and far from the others.

    An example is -9999 with others in 0 to 240. Few voxels may lie between: a saturated detector
    leaves many there.
    """
    values, counts = np.unique(distribution.sample, return_counts=True)
    if values.dtype.itemsize < 2 or len(values) <= FEWEST_OTHERS:
        return []
    numbers, found = values.astype(np.float64), []
    for end, others in ((0, slice(1, None)), (-1, slice(None, -1))):
        upto = np.cumsum(counts[others])
        places = np.searchsorted(upto, [TAIL * upto[-1], (1 - TAIL) * upto[-1]])
        lo, hi = numbers[others][places]
        distance = abs(numbers[end] - (hi if end else lo))
        on_the_way = counts[np.abs(numbers - numbers[end]) < 0.75 * distance].sum() - counts[end]
        is_repeated = counts[end] >= max(LEAST_SHARE * counts.sum(), FEWEST)
        if is_repeated and 100 * on_the_way <= counts[end] and distance > FAR * (hi - lo) > 0:
            found.append(float(numbers[end]))
    return found
