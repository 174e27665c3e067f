"""The formats whose heads are parsed here: NRRD, MetaImage, raw, VTI and legacy VTK."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from volume_writers import (
    ORIGIN,
    SPACING,
    voxels,
    vtk_image,
    write_itk,
    write_metaimage,
    write_nrrd,
)
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkBitArray, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOLegacy import vtkStructuredPointsWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLImageDataWriter

from model.errors import VolumeError
from model.volume_files import Choice, RawLayout, read_volume
from model.volume_files.choice import LARGEST
from model.volume_files.vti import read_vti

CASES = Path(__file__).parent / "cases"
ARRAY = voxels("float32")


def said(volume):
    return " ".join(volume.notes)


def vtk_values(path, name, in_cells=False):
    """An array as VTK reads it, and the image's geometry."""
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    data = image.GetCellData() if in_cells else image.GetPointData()
    shape = [n - in_cells for n in image.GetDimensions()[::-1]]
    return vtk_to_numpy(data.GetArray(name)).reshape(shape), image


# --- VTI and legacy VTK -------------------------------------------------------------------


@pytest.mark.parametrize("file", ["a_cells_only.vti", "b_cells_and_ids.vti"])
def test_cells_are_voxels_and_ids_come_last(file):
    path = CASES / "vtk" / file
    volume = read_volume(path)
    expected, image = vtk_values(path, "density", in_cells=True)
    np.testing.assert_array_equal(volume.voxels, expected)
    assert volume.spacing == image.GetSpacing()
    # The first voxel is the middle of the first cell.
    cell = image.GetCell(0).GetBounds()
    assert volume.origin == pytest.approx(
        [(a + b) / 2 for a, b in zip(cell[::2], cell[1::2], strict=True)]
    )
    assert "belong to cells" in said(volume)
    if file.startswith("b"):
        assert [content.name for content in volume.file.contents] == [
            "density",
            "vtkOriginalPointIds",
        ]
        ids = read_volume(path, choice=Choice(array="vtkOriginalPointIds"))
        np.testing.assert_array_equal(ids.voxels, vtk_values(path, "vtkOriginalPointIds")[0])


def test_negative_spacing_is_a_mirror():
    path = CASES / "vtk" / "k_negative_spacing.vti"
    expected, image = vtk_values(path, "density")
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, expected[::-1])
    assert volume.spacing == (1, 1, 2)
    bounds = image.GetBounds()
    assert volume.origin == pytest.approx((bounds[0], bounds[2], bounds[4]))
    assert "mirrors" in said(volume)


def test_a_piece_of_a_larger_whole():
    path = CASES / "vtk" / "l_piece_of_larger.vti"
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, vtk_values(path, "density")[0][:12])
    assert "a piece of a whole of 28 x 20 x 24 points" in said(volume)


def image_with(points=(), cells=()):
    image = vtkImageData()
    nz, ny, nx = ARRAY.shape
    image.SetDimensions(nx, ny, nz)
    image.SetSpacing(*SPACING)
    image.SetOrigin(*ORIGIN)
    for name, array, data in (
        *((n, a, image.GetPointData()) for n, a in points),
        *((n, a, image.GetCellData()) for n, a in cells),
    ):
        stored = numpy_to_vtk(array.ravel(), 1)
        stored.SetName(name)
        data.AddArray(stored)
    return image


def written(path, image):
    writer = vtkXMLImageDataWriter()
    writer.SetInputData(image)
    writer.SetFileName(str(path))
    assert writer.Write()
    return path


@pytest.mark.parametrize("kind", ["points", "cells", "valid"])
def test_what_ghost_types_hide_is_missing(tmp_path, kind):
    array = ARRAY[:-1, :-1, :-1] if kind == "cells" else ARRAY
    hidden = np.zeros(array.shape, np.uint8)
    hidden[1, 2, 3:] = {"points": 2, "cells": 32, "valid": 1}[kind]
    # A duplicate of another process' voxel is none that is missing.
    hidden[0, 0, 0] = 0 if kind == "valid" else 1
    name = "vtkValidPointMask" if kind == "valid" else "vtkGhostType"
    stored = 1 - hidden if kind == "valid" else hidden
    arrays = [("density", array), (name, stored)]
    image = image_with(**{"cells" if kind == "cells" else "points": arrays})
    grid = read_vti(written(tmp_path / "a.vti", image), LARGEST)
    np.testing.assert_array_equal(grid.missing, hidden > 1 if kind != "valid" else hidden == 1)
    assert "missing by what the file says" in said(read_volume(tmp_path / "a.vti"))
    assert read_volume(tmp_path / "a.vti").file.contents == ()


def test_active_scalars_come_first_and_masks_last(tmp_path):
    image = image_with([("mask", np.ones(ARRAY.shape, np.uint8)), ("a", ARRAY), ("b", 2 * ARRAY)])
    image.GetPointData().SetActiveScalars("b")
    path = written(tmp_path / "a.vti", image)
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, 2 * ARRAY)
    assert [content.name for content in volume.file.contents] == ["b", "a", "mask"]
    np.testing.assert_array_equal(read_volume(path, choice=Choice(array="a")).voxels, ARRAY)


def test_arrays_of_texts_are_left_out(tmp_path):
    image = image_with([("density", ARRAY)])
    names = vtkStringArray()
    names.SetName("names")
    for _ in range(ARRAY.size):
        names.InsertNextValue("x")
    image.GetPointData().AddArray(names)
    volume = read_volume(written(tmp_path / "a.vti", image))
    np.testing.assert_array_equal(volume.voxels, ARRAY)
    assert volume.file.contents == ()


def test_legacy_files_of_cells_and_several_arrays(tmp_path):
    image = image_with([("ids", np.arange(ARRAY.size))], [("density", ARRAY[:-1, :-1, :-1])])
    writer = vtkStructuredPointsWriter()
    writer.SetInputData(image)
    writer.SetFileName(str(tmp_path / "a.vtk"))
    writer.SetFileTypeToBinary()
    assert writer.Write()
    volume = read_volume(tmp_path / "a.vtk")
    np.testing.assert_array_equal(volume.voxels, ARRAY[:-1, :-1, :-1])


def test_directions_of_vti(tmp_path):
    image = vtk_image(ARRAY)
    image.SetDirectionMatrix(0, 1, 0, 0, 0, 1, 1, 0, 0)
    volume = read_volume(written(tmp_path / "a.vti", image))
    assert volume.file.directions == ((0, 0, 1), (1, 0, 0), (0, 1, 0))


# --- NRRD and MetaImage -------------------------------------------------------------------


def test_empty_lines_of_a_metaimage():
    path = CASES / "metaimage" / "empty_lines.mha"
    image = sitk.ReadImage(str(path))
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, sitk.GetArrayFromImage(image))
    assert volume.spacing == pytest.approx(image.GetSpacing())
    assert volume.origin == pytest.approx(image.GetOrigin())


def test_negative_spacing_of_a_metaimage_is_as_in_itk(tmp_path):
    fields = ["ElementSpacing = 0.5 2 -3", "Offset = 10 -20 30"]
    path = write_metaimage(tmp_path / "a.mha", voxels(), *fields, "DistanceUnits = um")
    image = sitk.ReadImage(str(path))
    volume = read_volume(path)
    last = image.TransformIndexToPhysicalPoint((0, 0, 5))
    np.testing.assert_array_equal(volume.voxels, sitk.GetArrayFromImage(image)[::-1])
    assert volume.origin == pytest.approx(last)
    assert volume.file.spacing_unit == "um"
    assert "mirrors" in said(volume)


def test_negative_spacings_minima_and_units_of_a_nrrd(tmp_path):
    fields = ["spacings: -0.5 2 3", "axis mins: 10 -20 30", 'units: "mm" "mm" "mm"']
    path = write_nrrd(tmp_path / "a.nrrd", voxels(), "encoding: raw", *fields)
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.voxels, voxels()[:, :, ::-1])
    assert (volume.spacing, volume.origin) == (SPACING, (7, -20, 30))
    assert volume.file.spacing_unit == "mm"


TIMES = voxels("uint16", (4, 6, 5, 11))


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("time", [0, 2, 3])
@pytest.mark.parametrize("kind", ["kinds: domain domain domain time", "# none", "mha"])
def test_time_steps_are_no_components(tmp_path, kind, time, compressed):
    array = TIMES if kind.startswith("kinds") else np.concatenate([TIMES, TIMES + 1, TIMES + 2])
    data = zlib.compress(array.tobytes()) if compressed else array.tobytes()
    if kind == "mha":
        fields = [f"CompressedData = {compressed}"]
        path = write_metaimage(tmp_path / "a.mha", array, *fields, data=data)
    else:
        encoding = f"encoding: {'gzip' if compressed else 'raw'}"
        path = write_nrrd(tmp_path / "a.nrrd", array, encoding, kind, data=data)
    volume = read_volume(path, choice=Choice(time=str(time)))
    np.testing.assert_array_equal(volume.voxels, array[time])
    assert [content.kind for content in volume.file.contents] == ["time"] * len(array)


def test_time_as_the_first_axis_of_a_nrrd(tmp_path):
    array = np.moveaxis(TIMES, 0, -1)
    fields = ["kinds: time domain domain domain", "encoding: raw"]
    path = write_nrrd(tmp_path / "a.nrrd", array, *fields, data=array.tobytes())
    volume = read_volume(path, choice=Choice(time="2"))
    np.testing.assert_array_equal(volume.voxels, TIMES[2])


def test_units_of_a_space(tmp_path):
    fields = [
        "space: LPS",
        "space directions: (1,0,0) (0,1,0) (0,0,1)",
        'space units: "um" "um" "um"',
    ]
    path = write_nrrd(tmp_path / "a.nrrd", voxels(), "encoding: raw", *fields)
    facts = read_volume(path).file
    assert (facts.spacing_unit, facts.space) == ("um", "LPS")


# --- raw ----------------------------------------------------------------------------------

HEADED = CASES / "raw" / "header_28x20x12_uint16.raw"


def test_a_header_is_offered_to_be_skipped():
    with pytest.raises(VolumeError, match="512 bytes more than 28 x 20 x 12 voxels of uint16") as e:
        read_volume(HEADED)
    layout = RawLayout.parse(e.value.suggested["raw"])
    assert layout == RawLayout((28, 20, 12), "uint16", offset=512)
    expected = np.frombuffer(HEADED.read_bytes()[512:], "<u2").reshape(12, 20, 28)
    np.testing.assert_array_equal(read_volume(HEADED, raw=layout).voxels, expected)


def test_an_offset_comes_back_from_its_text():
    layout = RawLayout((7, 5, 6), "int16", "big", (1, 2, 3), 352)
    assert RawLayout.parse(layout.text) == layout
    assert RawLayout.parse("7x5x6_int16 skip=352") == RawLayout((7, 5, 6), "int16", offset=352)


def test_components_of_itk_are_said(tmp_path):
    path = write_itk(tmp_path / "a.mha", voxels("uint8", (6, 5, 7, 3)), vector=True)
    assert "Every voxel has 3 components; their magnitude is read" in said(read_volume(path))


def test_metaimage_is_neither_mirrored_nor_sheared(tmp_path):
    array = voxels()
    image = sitk.GetImageFromArray(array)
    image.SetDirection((1, 0, 0, 0, 1, 0, 0, 0, -1))
    sitk.WriteImage(image, str(tmp_path / "flip.mha"))
    volume = read_volume(tmp_path / "flip.mha")
    np.testing.assert_array_equal(volume.voxels, array[::-1])
    # Where ITK has the last slice.
    last = image.TransformIndexToPhysicalPoint((0, 0, len(array) - 1))
    assert volume.origin == pytest.approx(last)
    assert "left-handed" in said(volume) and volume.up == "+z"
    fields = ["ElementSpacing = 1 1 2", "TransformMatrix = 1 0 0 0 1 0 0 .6 .8"]
    volume = read_volume(write_metaimage(tmp_path / "shear.mha", array, *fields))
    assert "sheared back" in said(volume) and volume.missing is not None
    assert volume.spacing == pytest.approx((1, 1, 1.6))


def test_a_vti_that_its_direction_mirrors(tmp_path):
    image = vtk_image(ARRAY)
    image.SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, -1)
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(tmp_path / "a.vti"))
    writer.SetInputData(image)
    writer.Write()
    volume = read_volume(tmp_path / "a.vti")
    np.testing.assert_array_equal(volume.voxels, ARRAY[::-1])
    point = [0.0, 0.0, 0.0]
    image.TransformIndexToPhysicalPoint(0, 0, len(ARRAY) - 1, point)
    assert volume.origin == pytest.approx(tuple(point))


def test_a_vti_without_arrays_spacing_or_whole_bytes_says_so(tmp_path):
    path = tmp_path / "a.vti"
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetDataModeToAscii()
    image = vtk_image(ARRAY)
    writer.SetInputData(image)
    writer.Write()
    spacing = " ".join(f"{step:g}" for step in image.GetSpacing())
    assert f'Spacing="{spacing}"' in path.read_text()
    path.write_text(path.read_text().replace(f'Spacing="{spacing}"', ""))
    assert "no voxel spacing" in said(read_volume(path))
    bits = vtkBitArray()
    bits.SetName("bits")
    bits.SetNumberOfValues(ARRAY.size)
    bits.FillComponent(0, 1)
    image.GetPointData().SetScalars(bits)
    writer.Write()
    with pytest.raises(VolumeError, match="array of bits"):
        read_volume(path)
    empty = vtkImageData()
    empty.SetDimensions(5, 5, 5)
    writer.SetInputData(empty)
    writer.Write()
    with pytest.raises(VolumeError, match="holds no values"):
        read_volume(path)
