"""Folders of TIFF files, each a slice or a volume, distinguished by the numbers in their names."""

from __future__ import annotations

import itertools
import re
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mode
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.volume import Caution, FileFacts
from model.volume_files.arrays import StoredArray
from model.volume_files.blocks import counted
from model.volume_files.checks import check_grid, slices_in, times
from model.volume_files.choice import LARGEST, Choice, chosen_index, content, contents
from model.volume_files.grid import Grid, placed
from model.volume_files.tiff import (
    SUFFIXES,
    calibrated,
    dimensions_of,
    opened_tiff,
    read_tiff,
    stored,
)

if TYPE_CHECKING:
    from tifffile import TiffFile

_NUMBER = re.compile(r"-?\d+")
MOST_LISTED = 12


def tiff_slices(folder: Path) -> list[Path]:
    """Return the TIFF files of a folder, with numbers in their names in numeric order."""
    files = slices_in(folder, SUFFIXES)
    return sorted((path for path in files if path.suffix.lower() in SUFFIXES), key=natural_key)


def read_tiff_folder(folder: Path, slices: Sequence[Path], choice: Choice = LARGEST) -> Grid:
    """Read one series of a folder: the chosen one, or the longest by file names."""
    series = named_series(slices)
    with opened_tiff(series[0].files[0]) as tiff:
        is_stack = len(tiff.series) == 1 and min(dimensions_of(_first(tiff))) > 1
    if is_stack:
        return _one_of_stacks(folder, slices, choice)
    names = [each.name for each in series]
    number = chosen_index(folder, "series", names, choice.series)
    files = series[number].files
    with opened_tiff(files[0]) as tiff:
        first = _first(tiff)
        (nx, ny, _), samples = dimensions_of(first), _samples(first)
    listed = tuple(
        content("series", other.name, (nx, ny, len(other.files)), first.dtype, each == number)
        for each, other in enumerate(series if names[1:] else [])
    )
    check_grid(folder, (nx, ny, len(files)), first.dtype, samples)
    values: NDArray[np.generic] = np.empty((len(files), ny, nx, samples), first.dtype)
    units = ""
    notes: tuple[str, ...] = ()
    for z, path in enumerate(counted("slices read", files)):
        with opened_tiff(path) as tiff:
            array = _first(tiff)
            _check_slice(path, array, len(tiff.pages), files[0].name, first)
            plane = array.read(tuple(slice(None) for _ in array.axes))
            plane, units, notes = calibrated(tiff, plane)
            if plane.dtype != values.dtype:
                values = values.astype(plane.dtype)
            values[z] = plane.reshape(values.shape[1:])
    grid = Grid(
        values if samples > 1 else values[..., 0],
        units=units,
        notes=series[number].gap_notes + notes + first.notes,
        facts=FileFacts("TIFF slices", first.unit, contents=listed),
    )
    return placed(grid, first.spacing)


def _one_of_stacks(folder: Path, files: Sequence[Path], choice: Choice) -> Grid:
    """Read one of several files, each of which is a volume."""
    names = [path.name for path in files]
    number = chosen_index(folder, "series", names, choice.series)
    grid = read_tiff(files[number], replace(choice, series=None))
    nz, ny, nx = grid.values.shape[:3]
    listed = contents("series", names, (nx, ny, nz), grid.values.dtype, number)
    return replace(grid, facts=replace(grid.facts, contents=listed + grid.facts.contents))


def _first(tiff: TiffFile) -> StoredArray:
    """Return the first volume or image of a file."""
    return stored(Path(tiff.filehandle.path), tiff, 0, tiff.series[0])[0]


def _samples(array: StoredArray) -> int:
    return array.shape[-1] if array.axes[-1] == "components" else 1


def _check_slice(
    path: Path, array: StoredArray, pages: int, first_name: str, first: StoredArray
) -> None:
    """Raise VolumeError if a file is no slice like the first of its series."""
    if pages != 1 or {*array.axes} & {*"ztc"}:
        raise VolumeError(
            f"{path}: this slice of a stack has {max(pages, dimensions_of(array)[2])} pages; "
            "open it by itself, or keep one page per file."
        )
    facts, expected = (
        f"{times((*dimensions_of(each)[:2], _samples(each)))} of {each.dtype}"
        for each in (array, first)
    )
    if facts != expected:
        raise VolumeError(
            f"{path}: the slices differ in size, type or storage: this one has {facts}, "
            f"{first_name} {expected}; keep those of one volume together."
        )


# --- names --------------------------------------------------------------------------------


@dataclass(frozen=True)
class NamedSeries:
    """Files whose names differ in one number, ``*`` in the series' name, in its order."""

    name: str
    files: tuple[Path, ...]
    numbers: tuple[int, ...] = ()

    @property
    def gap_notes(self) -> tuple[str, ...]:
        """Sentences on numbers that are missing."""
        steps = [b - a for a, b in itertools.pairwise(self.numbers)]
        usual = mode(steps) if steps else 0
        missing = [
            number
            for first, last in itertools.pairwise(self.numbers)
            for number in range(first + usual, last, max(usual, 1))
        ]
        if usual < 1 or not missing:
            return ()
        said = f"Slices are missing: {listed_numbers(missing)}; those around them are shown "
        return (Caution(said + "next to each other."),)


def listed_numbers(numbers: Sequence[int]) -> str:
    """Format increasing numbers for a sentence, with runs as ``"3 to 9"``."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    texts = []
    for run in runs:
        texts += [f"{run[0]} to {run[-1]}"] if len(run) > 2 else [str(number) for number in run]
    if len(texts) > MOST_LISTED:
        return ", ".join(texts[:MOST_LISTED]) + f" and more, {len(numbers)} in all"
    return " and ".join([", ".join(texts[:-1]), texts[-1]]) if len(texts) > 1 else texts[0]


def natural_key(path: Path) -> list[tuple[int, str]]:
    """Sort key that puts slice 9 before slice 10."""
    return [
        (int(word), "") if word.isdigit() and word.isascii() else (0, word)
        for word in re.split(r"(\d+)", path.name.lower())
    ]


def named_series(files: Sequence[Path]) -> list[NamedSeries]:
    """Group files whose names differ only in the number of the slice.

    That number is the one with the most values, or the last of these. A minus is a sign only if
    some names have none there. The longest group is first; files with unlike names form one.
    """
    frames: dict[str, list[Path]] = defaultdict(list)
    for path in files:
        frames[_NUMBER.sub("#", path.name)].append(path)
    found = [series for alike in frames.values() for series in _split(alike)]
    if max(len(series.files) for series in found) < 2:
        ordered = sorted(files, key=natural_key)
        return [NamedSeries("*" + ordered[0].suffix, tuple(ordered))]
    return sorted(found, key=lambda series: (-len(series.files), series.name))


def _split(files: list[Path]) -> list[NamedSeries]:
    """Split files whose names differ in numbers only."""
    rows = [_NUMBER.findall(path.name) for path in files]
    columns = list(zip(*rows, strict=True))
    signed = [0 < sum(word[0] == "-" for word in column) < len(column) for column in columns]
    values = [
        [int(word) if is_signed else int(word.lstrip("-")) for word in column]
        for column, is_signed in zip(columns, signed, strict=True)
    ]
    counts = [len(set(column)) for column in values]
    if not counts or max(counts) < 2:
        return [NamedSeries(path.name, (path,)) for path in files]
    slice_column = max(range(len(counts)), key=lambda k: (counts[k], k))
    series: dict[tuple[int, ...], list[int]] = defaultdict(list)
    for row in range(len(files)):
        others = tuple(column[row] for k, column in enumerate(values) if k != slice_column)
        series[others].append(row)
    if len(series) > len(files) / 2:
        # Every slice has more than one number of its own, such as the time of its taking.
        series = {(): list(range(len(files)))}
        slice_column = counts.index(max(counts))
    named = []
    for members in series.values():
        numbers = values[slice_column]
        members.sort(key=lambda row: (numbers[row], natural_key(files[row])))
        ordered = tuple(files[row] for row in members)
        name = ordered[0].name
        start, end = [*_NUMBER.finditer(name)][slice_column].span()
        of_slices = tuple(numbers[row] for row in members)
        named.append(NamedSeries(f"{name[:start]}*{name[end:]}", ordered, of_slices))
    return named
