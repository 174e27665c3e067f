"""VTI and legacy VTK files, against VTK's own readers and writers."""

from pathlib import Path

import numpy as np
import pytest
import volume_writers as files
from volume_writers import check, refused, voxels
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkBitArray
from vtkmodules.vtkIOLegacy import vtkStructuredPointsWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLImageDataWriter

from model.volume_files import Choice, read_volume
from model.volume_files.choice import LARGEST
from model.volume_files.vtk_images import read_vti

CASES = Path(__file__).parent / "cases" / "vtk"
ARRAY = voxels("float32")
CELLS = ARRAY[:-1, :-1, :-1]


@pytest.mark.parametrize("mode", ["Appended", "Binary", "Ascii"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZ4", "LZMA"])
@pytest.mark.parametrize("encode", [False, True])
def test_vti_encodings(tmp_path, mode, compressor, encode):
    path = files.write_vti(tmp_path / "a.vti", voxels(), mode, compressor, encode)
    check(read_volume(path), voxels(), spacing=files.SPACING, origin=files.ORIGIN)


@pytest.mark.parametrize("dtype", files.ALL_TYPES)
def test_legacy_vtk_in_ascii(tmp_path, dtype):
    array = voxels(dtype) if dtype in files.INTEGER_TYPES else np.round(voxels(dtype), 2)
    volume = read_volume(files.write_legacy(tmp_path / "a.vtk", array, binary=False))
    rtol = 0 if dtype in files.INTEGER_TYPES else 1e-5
    np.testing.assert_allclose(volume.voxels, array, rtol=rtol)
    assert volume.voxels.dtype == dtype


def test_legacy_vtk_by_hand(tmp_path):
    header = (
        "# vtk DataFile Version 3.0\nby hand\nBINARY\nDATASET STRUCTURED_POINTS\n"
        "DIMENSIONS 7 5 6\nASPECT_RATIO 0.5 2 3\nORIGIN 10 -20 30\nPOINT_DATA 210\n"
        "SCALARS density unsigned_short 1\nLOOKUP_TABLE default\n"
    )
    path = tmp_path / "a.vtk"
    path.write_bytes(header.encode() + voxels().astype(">u2").tobytes())
    check(read_volume(path), voxels(), spacing=files.SPACING, origin=files.ORIGIN)


def vtk_values(path, name, in_cells=False):
    """An array as VTK reads it, and the image's geometry."""
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    data = image.GetCellData() if in_cells else image.GetPointData()
    shape = [n - in_cells for n in image.GetDimensions()[::-1]]
    return vtk_to_numpy(data.GetArray(name)).reshape(shape), image


@pytest.mark.parametrize("file", ["a_cells_only.vti", "b_cells_and_ids.vti"])
def test_cells_are_voxels_and_ids_come_last(file):
    path = CASES / file
    volume = read_volume(path)
    expected, image = vtk_values(path, "density", in_cells=True)
    # The first voxel is the middle of the first cell.
    cell = image.GetCell(0).GetBounds()
    middle = [(a + b) / 2 for a, b in zip(cell[::2], cell[1::2], strict=True)]
    check(volume, expected, "belong to cells", spacing=image.GetSpacing(), origin=middle)
    if file.startswith("b"):
        names = [content.name for content in volume.file.contents]
        assert names == ["density", "vtkOriginalPointIds"]
        ids = read_volume(path, choice=Choice(array="vtkOriginalPointIds"))
        check(ids, vtk_values(path, "vtkOriginalPointIds")[0])


def test_negative_spacing_is_a_mirror():
    path = CASES / "k_negative_spacing.vti"
    expected, image = vtk_values(path, "density")
    first = image.GetBounds()[::2]
    check(read_volume(path), expected[::-1], "mirrors", spacing=(1, 1, 2), origin=first)


def test_a_piece_of_a_larger_whole():
    path = CASES / "l_piece_of_larger.vti"
    said = "a piece of a whole of 28 x 20 x 24 points"
    check(read_volume(path), vtk_values(path, "density")[0][:12], said)


def image_with(points=(), cells=()):
    image = files.vtk_image(ARRAY)
    image.GetPointData().Initialize()
    for arrays, data in ((points, image.GetPointData()), (cells, image.GetCellData())):
        for name, array in arrays:
            stored = numpy_to_vtk(array.ravel(), 1)
            stored.SetName(name)
            data.AddArray(stored)
    return image


def written(path, image, is_text=False):
    writer = vtkXMLImageDataWriter() if path.suffix == ".vti" else vtkStructuredPointsWriter()
    writer.SetInputData(image)
    writer.SetFileName(str(path))
    if is_text:
        writer.SetDataModeToAscii()
    if path.suffix == ".vtk":
        writer.SetFileTypeToBinary()
    assert writer.Write()
    return path


@pytest.mark.parametrize("kind", ["points", "cells", "valid"])
def test_what_ghost_types_hide_is_missing(tmp_path, kind):
    array = CELLS if kind == "cells" else ARRAY
    hidden = np.zeros(array.shape, np.uint8)
    hidden[1, 2, 3:] = {"points": 2, "cells": 32, "valid": 1}[kind]
    # A duplicate of another process' voxel is none that is missing.
    hidden[0, 0, 0] = 0 if kind == "valid" else 1
    name = "vtkValidPointMask" if kind == "valid" else "vtkGhostType"
    arrays = [("density", array), (name, 1 - hidden if kind == "valid" else hidden)]
    image = image_with(**{"cells" if kind == "cells" else "points": arrays})
    grid = read_vti(written(tmp_path / "a.vti", image), LARGEST)
    np.testing.assert_array_equal(grid.missing, hidden > 1 if kind != "valid" else hidden == 1)
    volume = read_volume(tmp_path / "a.vti")
    assert "as missing" in " ".join(volume.notes)
    assert volume.file.contents == ()


def test_active_scalars_come_first_and_masks_last(tmp_path):
    image = image_with([("mask", np.ones(ARRAY.shape, np.uint8)), ("a", ARRAY), ("b", 2 * ARRAY)])
    image.GetPointData().SetActiveScalars("b")
    path = written(tmp_path / "a.vti", image)
    volume = read_volume(path)
    check(volume, 2 * ARRAY)
    assert [content.name for content in volume.file.contents] == ["b", "a", "mask"]
    check(read_volume(path, choice=Choice(array="a")), ARRAY)


def test_legacy_files_of_cells_and_several_arrays(tmp_path):
    image = image_with([("ids", np.arange(ARRAY.size))], [("density", CELLS)])
    check(read_volume(written(tmp_path / "a.vtk", image)), CELLS)


@pytest.mark.parametrize(("matrix", "directions"), [
    ((0, 1, 0, 0, 0, 1, 1, 0, 0), ((0, 0, 1), (1, 0, 0), (0, 1, 0))),
    ((1, 0, 0, 0, 1, 0, 0, 0, -1), ((1, 0, 0), (0, 1, 0), (0, 0, 1))),
])  # fmt: skip
def test_directions_of_vti(tmp_path, matrix, directions):
    image = files.vtk_image(ARRAY)
    image.SetDirectionMatrix(*matrix)
    volume = read_volume(written(tmp_path / "a.vti", image))
    mirrored, point = matrix[-1] < 0, [0.0, 0.0, 0.0]
    image.TransformIndexToPhysicalPoint(0, 0, (len(ARRAY) - 1) * mirrored, point)
    expected = ARRAY[::-1] if mirrored else ARRAY
    check(volume, expected, origin=tuple(point), directions=directions)


def test_a_vti_without_spacing_or_whole_bytes_says_so(tmp_path):
    image, path = files.vtk_image(ARRAY), tmp_path / "a.vti"
    written(path, image, is_text=True)
    spacing = f'Spacing="{" ".join(f"{step:g}" for step in image.GetSpacing())}"'
    assert spacing in path.read_text()
    path.write_text(path.read_text().replace(spacing, ""))
    assert "no voxel spacing" in " ".join(read_volume(path).notes)
    bits = vtkBitArray()
    bits.SetName("bits")
    bits.SetNumberOfValues(ARRAY.size)
    bits.FillComponent(0, 1)
    image.GetPointData().SetScalars(bits)
    written(path, image, is_text=True)
    refused(path, "array of bits")
