"""TIFF stacks, as one file of several pages or a folder of slices, read by VTK."""

from __future__ import annotations

import re
from pathlib import Path

from model.errors import VolumeError
from model.volume_files.checks import check_grid, unsupported, usable_spacing
from model.volume_files.grid import Grid
from model.volume_files.tiff_pages import Page, read_pages
from model.volume_files.vtk_session import run_quietly, to_numpy

SUFFIXES = (".tif", ".tiff")
READABLE_TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "f4")


def tiff_slices(folder: Path) -> list[Path]:
    """Return the TIFF files of a folder, with numbers in their names in numeric order."""
    return sorted(
        (path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES), key=_natural
    )


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
    from vtkmodules.vtkCommonCore import vtkStringArray
    from vtkmodules.vtkIOImage import vtkTIFFReader

    first = pages[0]
    if any(page.layout != first.layout for page in pages):
        raise VolumeError(
            f"{path}: its slices differ in size, type or storage; "
            "keep those of one volume together."
        )
    _check_kind(path, first)
    dimensions = (first.width, first.height, len(pages))
    check_grid(path, dimensions, first.scalar_type, first.samples)
    reader = vtkTIFFReader()
    if len(files) == 1:
        reader.SetFileName(str(files[0]))
    else:
        names = vtkStringArray()
        for file in files:
            names.InsertNextValue(str(file))
        reader.SetFileNames(names)
    run_quietly(path, reader.Update)
    image = reader.GetOutput()
    values = to_numpy(image.GetPointData().GetScalars(), image.GetDimensions())
    if image.GetDimensions() != dimensions or values.dtype != first.scalar_type:
        raise unsupported(path, "this layout of TIFF pages", "save it as a plain grey-scale stack")
    spacing, notes = usable_spacing(first.calibration)
    return Grid(values, spacing, notes=notes)


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
