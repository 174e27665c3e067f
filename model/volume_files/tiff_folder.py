"""Folders of TIFF files, each a slice or a volume of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.file_facts import Content, FileFacts
from model.volume_files.checks import check_grid, slices_in, times
from model.volume_files.choice import LARGEST, Choice, choice_notes, chosen_index, content, contents
from model.volume_files.file_names import NamedSeries, named_series, natural_key
from model.volume_files.frame import usable_spacing
from model.volume_files.grid import Grid
from model.volume_files.progress import counted
from model.volume_files.tiff import SUFFIXES, opened_tiff, read_tiff
from model.volume_files.tiff_scale import Scale, calibrated, voxel_scale
from model.volume_files.tiff_stack import Stack, check_pages, read_stack, stack_of


def tiff_slices(folder: Path) -> list[Path]:
    """Return the TIFF files of a folder, with numbers in their names in numeric order."""
    files = slices_in(folder, SUFFIXES)
    return sorted((path for path in files if path.suffix.lower() in SUFFIXES), key=natural_key)


def read_tiff_folder(
    folder: Path,
    slices: Sequence[Path],
    choice: Choice = LARGEST,
) -> Grid:
    """Read one series of a folder: by the names of the files the longest, or the chosen one."""
    series = named_series(slices)
    if _is_volume(series[0].files[0]):
        return _one_of_stacks(folder, slices, choice)
    names = [each.name for each in series]
    number = chosen_index(folder, "series", names, choice.series)
    chosen = series[number]
    with opened_tiff(chosen.files[0]) as tiff:
        first = stack_of(tiff.series[0])
        dtype, (nx, ny, _), samples = first.dtype, first.dimensions, first.samples
        scale = voxel_scale(tiff, 0)
    listed = tuple(
        content("series", other.name, (nx, ny, len(other.files)), dtype, each == number)
        for each, other in enumerate(series)
    )
    return _read(folder, chosen, (nx, ny), dtype, samples, scale, listed if names[1:] else ())


def _is_volume(path: Path) -> bool:
    with opened_tiff(path) as tiff:
        return len(tiff.series) == 1 and stack_of(tiff.series[0]).is_volume


def _one_of_stacks(folder: Path, files: Sequence[Path], choice: Choice) -> Grid:
    """Read one of several files, each of which is a volume."""
    names = [path.name for path in files]
    number = chosen_index(folder, "series", names, choice.series)
    grid = read_tiff(files[number], replace(choice, series=None))
    nz, ny, nx = grid.values.shape[:3]
    listed = contents("series", names, (nx, ny, nz), grid.values.dtype, number)
    facts = replace(grid.facts, contents=listed + grid.facts.contents)
    return replace(grid, facts=facts, notes=choice_notes(listed) + grid.notes)


def _read(
    folder: Path,
    series: NamedSeries,
    size: tuple[int, int],
    dtype: np.dtype[np.generic],
    samples: int,
    scale: Scale,
    listed: tuple[Content, ...],
) -> Grid:
    nx, ny = size
    count = len(series.files)
    check_grid(folder, (nx, ny, count), dtype, samples)
    values: NDArray[np.generic] = np.empty((count, ny, nx, samples), dtype)
    units = ""
    notes: tuple[str, ...] = ()
    for z, path in enumerate(counted("slices read", series.files)):
        with opened_tiff(path) as tiff:
            stack = stack_of(tiff.series[0])
            _check_slice(path, series.files[0], stack, len(tiff.pages), (size, dtype, samples))
            plane = read_stack(path, stack, {})
            plane, units, notes = calibrated(tiff, plane)
            if plane.dtype != values.dtype:
                values = values.astype(plane.dtype)
            values[z] = plane.reshape(values.shape[1:])
    spacing, spacing_notes = usable_spacing(scale.spacing)
    return Grid(
        values if samples > 1 else values[..., 0],
        spacing,
        units=units,
        notes=choice_notes(listed) + series.gap_notes + notes + scale.notes + spacing_notes,
        facts=FileFacts("TIFF slices", scale.unit, contents=listed),
    )


def _check_slice(
    path: Path,
    first: Path,
    stack: Stack,
    pages: int,
    expected: tuple[tuple[int, int], np.dtype[np.generic], int],
) -> None:
    """Raise VolumeError if a file is no slice like the first one of its series."""
    if pages != 1 or stack.dimensions[2] != 1 or stack.others:
        raise VolumeError(
            f"{path}: this slice of a stack has {max(pages, stack.dimensions[2])} pages; "
            "open it by itself, or keep one page per file."
        )
    if (stack.dimensions[:2], stack.dtype, stack.samples) != expected:
        (nx, ny), dtype, samples = expected
        own = f"{times((*stack.dimensions[:2], stack.samples))} of {stack.dtype}"
        raise VolumeError(
            f"{path}: the slices differ in size, type or storage: this one has {own}, {first.name} "
            f"{times((nx, ny, samples))} of {dtype}; keep those of one volume together."
        )
    check_pages(path, stack, flat=True)
