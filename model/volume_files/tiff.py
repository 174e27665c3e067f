"""TIFF stacks, as one file of several pages or a folder of slices, read by tifffile."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError, first_line
from model.volume_files.checks import check_grid, damaged, slices_in, unsupported, usable_spacing
from model.volume_files.grid import Grid
from model.volume_files.tiff_pages import Page, read_pages

SUFFIXES = (".tif", ".tiff")
READABLE_TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "f4")


def tiff_slices(folder: Path) -> list[Path]:
    """Return the TIFF files of a folder, with numbers in their names in numeric order.

    Raises
    ------
    VolumeError
        As for :func:`~model.volume_files.checks.slices_in`.
    """
    files = slices_in(folder, SUFFIXES)
    return sorted((path for path in files if path.suffix.lower() in SUFFIXES), key=_natural)


def read_tiff(path: Path) -> Grid:
    """Read a file whose pages are the slices.

    Raises
    ------
    VolumeError
        When the file is foreign, damaged, truncated, its pages differ, or it
        is of an unsupported kind (tiles, palettes, 64-bit voxels).
    """
    return _read(path, [path], read_pages(path))


def read_tiff_folder(folder: Path, slices: list[Path]) -> Grid:
    """Read a folder with one slice per file, in the order given.

    Raises
    ------
    VolumeError
        As for :func:`read_tiff`, and when a slice has several pages.
    """
    pages = []
    for path in slices:
        in_file = read_pages(path)
        if len(in_file) != 1:
            raise VolumeError(
                f"{path}: this slice of a stack has {len(in_file)} pages; "
                "open it by itself, or keep one page per file."
            )
        pages += in_file
    return _read(folder, slices, pages)


def _read(path: Path, files: list[Path], pages: list[Page]) -> Grid:
    first = pages[0]
    if any(page.layout != first.layout for page in pages):
        raise VolumeError(
            f"{path}: its slices differ in size, type or storage; "
            "keep those of one volume together."
        )
    _check_kind(path, first)
    check_grid(path, (first.width, first.height, len(pages)), first.scalar_type, first.samples)
    shape = (len(pages), first.height, first.width, first.samples)
    values = np.empty(shape, dtype=first.scalar_type)
    slices = iter(values)
    for file in files:
        _read_into(file, slices)
    if next(slices, None) is not None:
        raise damaged(path, "some of its pages cannot be found")
    spacing, notes = usable_spacing(first.calibration)
    return Grid(values[..., 0] if first.samples == 1 else values, spacing, notes=notes)


def _read_into(file: Path, slices: Iterator[NDArray[Any]]) -> None:
    """Read all pages of a file, each into the next of the slices.

    What the library only warns of, such as pixels that it takes for 0, is damage here.
    """
    import tifffile

    with _warnings_of("tifffile") as warnings:
        try:
            with tifffile.TiffFile(file) as tiff:
                for page in tiff.pages:
                    assert isinstance(page, tifffile.TiffPage)
                    pixels = page.asarray(maxworkers=1)
                    if page.planarconfig == 2 and page.samplesperpixel > 1:
                        pixels = np.moveaxis(pixels, 0, -1)
                    target = next(slices)
                    if pixels.dtype != target.dtype or pixels.size != target.size:
                        raise ValueError(f"a page of {pixels.dtype} {pixels.shape}")
                    target[...] = pixels.reshape(target.shape)
        except (OSError, MemoryError):
            raise
        except Exception as error:
            # Decoders raise errors of many kinds.
            raise damaged(file, f"its pixels cannot be unpacked: {first_line(error)}") from error
    if warnings:
        raise damaged(file, warnings[0])


@contextmanager
def _warnings_of(name: str) -> Iterator[list[str]]:
    """Collect what a library logs, instead of printing it."""
    logger, found = logging.getLogger(name), list[str]()
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: found.append(record.getMessage())  # type: ignore[method-assign]
    propagated, logger.propagate = logger.propagate, False
    logger.addHandler(handler)
    try:
        yield found
    finally:
        logger.removeHandler(handler)
        logger.propagate = propagated


def _check_kind(path: Path, page: Page) -> None:
    if page.scalar_type not in READABLE_TYPES:
        raise unsupported(
            path,
            f"a TIFF of {page.type_name} voxels",
            "convert it to integers of 8 to 32 bits or to float32, or save it as NRRD",
        )
    if page.tiled:
        raise unsupported(path, "a tiled TIFF", "save it in strips")
    if page.palette:
        raise unsupported(path, "a TIFF with a palette", "save it as grey values")


def _natural(path: Path) -> list[tuple[int, str]]:
    """Natural sort key, which puts slice 9 before slice 10."""
    return [
        (int(word), "") if word.isdigit() else (0, word)
        for word in re.split(r"(\d+)", path.name.lower())
    ]
