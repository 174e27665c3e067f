"""DICOM as scanners, archives and programs write it; values by the standard or SimpleITK."""

import shutil
from dataclasses import replace
from functools import partial
from pathlib import Path

import imagecodecs
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from pydicom.pixels.encoders import RLELosslessEncoder
from pydicom.uid import DeflatedExplicitVRLittleEndian, ExplicitVRBigEndian
from volume_writers import (
    ENHANCED_MR,
    ORIGIN,
    SPACING,
    check,
    dataset,
    item,
    refused,
    said,
    save_dicom,
    voxels,
    write_dicom,
)

from model.errors import VolumeError
from model.scene.volume import Caution, FileFacts
from model.volume_files import Choice, read_volume
from model.volume_files.dicom import dicom_slices, read_dicom

CASES = Path(__file__).parent / "cases" / "dicom"
HU = {"Modality": "CT", "RescaleSlope": 1, "RescaleIntercept": 0}


def itk(folder):
    """A series as ITK reads it."""
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder)))
    return reader.Execute()


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "int32", "uint32"])
def test_a_folder_in_any_order(tmp_path, dtype):
    order = [5, 2, 1, 0, 3, 4]
    places = [(10, -20, 30 + 3 * z) for z in order]
    folder = write_dicom(tmp_path / "ct", voxels(dtype)[order], positions=places, **HU)
    image = itk(folder)
    place = {"spacing": image.GetSpacing(), "origin": image.GetOrigin()}
    volume = read_volume(folder)
    check(volume, voxels(dtype), None, **place, name="ct", units="HU")
    assert (volume.spacing, volume.origin) == (SPACING, ORIGIN)
    assert volume.voxels.dtype == dtype and volume.axis_labels == tuple("LRPASI")


@pytest.mark.parametrize("dtype", ["uint16", "int16"])
@pytest.mark.parametrize(
    ("slope", "intercept", "read"),
    [(1, -1024, "int16"), (16, -1000, "int32"), (0.25, 3, "float32")],
)
def test_rescaling_is_simpleitks(tmp_path, dtype, slope, intercept, read):
    stored = (voxels(dtype) // 8).astype(dtype)
    tags = {"RescaleSlope": slope, "RescaleIntercept": intercept}
    folder = write_dicom(tmp_path / "ct", stored, **tags)
    expected = sitk.GetArrayFromImage(itk(folder)).astype(float)
    volume = read_volume(folder)
    check(volume, expected, rtol=1e-6)
    assert volume.voxels.dtype == read
    # They are the voxels of earlier versions, which had the type that the tags allow.
    wide = volume.voxels.astype("int32" if read == "int16" else read)
    assert volume.fingerprint == replace(volume, voxels=wide, file=FileFacts()).fingerprint
    assert expected.max() == pytest.approx(float(stored.max()) * slope + intercept)


def test_one_slice_stands_for_its_series(tmp_path):
    write_dicom(tmp_path, voxels())
    other = voxels("int16", (3, 5, 7))
    write_dicom(tmp_path, other, start=50, SeriesInstanceUID="9.9")
    check(read_volume(tmp_path / "051.dcm"), other)
    note = "Of 2 series 'series' is read (7 x 5 x 6); also there: series (2)."
    check(read_volume(tmp_path), voxels(), notes=(note,))
    # A disc has its series in folders, as exports have.
    note = "Of 2 series 'series (B)' is read (7 x 5 x 6); also there: series (C)."
    for start, name, each in ((0, "A/B", voxels()), (50, "A/C", other)):
        write_dicom(tmp_path / "disc" / name, each, start=start, SeriesInstanceUID=f"9.{start}")
    check(read_volume(tmp_path / "disc"), voxels(), notes=(note,))
    disc = write_dicom(tmp_path / "disc", voxels(), start=80)
    write_dicom(disc, voxels(), start=90, PixelSpacing=[1, 3])
    note = "Of 2 series 'series (0.5 x 2 mm)' is read; also there: series (3 x 1 mm)."
    check(read_volume(disc), voxels(), notes=(note,))
    (disc / "DICOMDIR").touch()
    (disc / "x.dcm").write_bytes(500 * b"?")
    assert any("left out: x.dcm." in note for note in read_volume(disc).notes)
    with pytest.raises(VolumeError, match=r"x\.dcm: this is not a DICOM file; choose another"):
        read_volume(disc / "x.dcm")
    assert len(read_volume(disc).file.contents) == 4


def test_sagittal_slices_have_the_patients_axes(tmp_path):
    # Rows towards the back, columns towards the feet, later slices farther to the left.
    places = [(10 * z, 0, 0) for z in range(6)]
    axes = [0, 1, 0, 0, 0, -1]
    folder = write_dicom(tmp_path, voxels("int16"), positions=places, ImageOrientationPatient=axes)
    labels = tuple("PAISRL")
    check(read_volume(folder), voxels("int16")[::-1], axis_labels=labels, up="-y")


def test_nuclear_medicine_has_the_place_of_its_detector(tmp_path):
    detector = item(ImagePositionPatient=[0, 0, 10], ImageOrientationPatient=[1, 0, 0, 0, 1, 0])
    tags = {"Modality": "NM", "SpacingBetweenSlices": -2.5, "ImageOrientationPatient": None}
    ds = dataset(voxels(), frames=len(voxels()), DetectorInformationSequence=detector, **tags)
    # As ITK places it: downwards, here read from below.
    place = {"spacing": (0.5, 2, 2.5), "origin": (0, 0, 10 - 2.5 * (len(voxels()) - 1))}
    check(read_volume(save_dicom(tmp_path / "a.dcm", ds)), voxels()[::-1], **place, up="+z")


def test_an_index_into_colours_and_a_name_of_another_kind(tmp_path):
    ds = dataset(voxels(), frames=len(voxels()), PhotometricInterpretation="PALETTE COLOR")
    check(read_volume(save_dicom(tmp_path / "a.tif", ds)), voxels(), "look-up table|a DICOM file")


@pytest.mark.parametrize(("case", "values", "spacing"), [
    ("no_preamble_implicit", (6, 3000), (1, 1, 2)), ("un_undefined_all", (6, 3000), (1, 1, 2)),
    ("enhanced_single", (-988, 14000), (0.5, 0.5, 3)),
])  # fmt: skip
def test_files_that_itk_reads_in_the_same_way(case, values, spacing):
    planes = {}
    for path in (CASES / case).iterdir():
        image = sitk.ReadImage(str(path))
        direction = np.array(image.GetDirection()).reshape(3, 3)[:, 2]
        planes[np.dot(image.GetOrigin(), direction)] = sitk.GetArrayFromImage(image)[0]
    expected = np.stack([planes[height] for height in sorted(planes)])
    facts = {"data_range": values, "spacing_unit": "mm", "space": "LPS", "units": ""}
    check(read_volume(CASES / case), expected, spacing=spacing, **facts)


def test_acquisitions_in_one_series_are_apart():
    for number in range(2):
        volume = read_volume(CASES / "interleaved_acquisitions", choice=Choice(series=str(number)))
        assert (volume.dimensions, volume.spacing) == ((16, 12, 10), (1, 1, 2))
        assert volume.origin == (0, 0, number)
        assert "acquisition 1" in said(volume) and "acquisition 2" in said(volume)


def test_padding_is_missing():
    folder = CASES / "padding_signed"
    grid = read_dicom(dicom_slices(folder))
    stored = sitk.GetArrayFromImage(itk(folder))
    np.testing.assert_array_equal(grid.missing, stored == -2000 - 1024)
    volume = read_volume(folder)
    assert volume.data_range == (stored[~grid.missing].min(), stored.max())
    assert volume.units == "HU"
    assert "marks 9088 voxels as missing" in said(volume)


@pytest.mark.parametrize(("case", "words", "distance"), [
    ("pixel_spacing_changes", "Of 2 series", None), ("monochrome1", "MONOCHROME1", None),
    ("gantry_tilt", "by 20.0 degrees, as by a tilted gantry", 2 * np.cos(np.radians(20))),
])  # fmt: skip
def test_what_is_odd_about_a_series_is_said(case, words, distance):
    volume = read_volume(CASES / case)
    (note,) = (each for each in volume.notes if words in each)
    # What misleads stays until it is dismissed.
    assert isinstance(note, Caution) == (case != "pixel_spacing_changes")
    assert distance is None or volume.spacing[2] == pytest.approx(distance)


def rle(plane):
    """One image as pydicom's encoder has it."""
    return RLELosslessEncoder.encode(dataset(plane))


LARGE = np.zeros((2000, 2000), np.uint16)
SYNTAX = "1.2.840.10008.1.2"
ENCODERS = {
    "5": rle,
    "4.70": imagecodecs.ljpeg_encode,
    "4.80": imagecodecs.jpegls_encode,
    "4.90": partial(imagecodecs.jpeg2k_encode, codecformat="j2k", reversible=True, level=0),
}


def compressed(folder, array, syntax, encode, **tags):
    encoded = [[encode(np.ascontiguousarray(plane))] for plane in array]
    each = lambda z: {"encoded": encoded[z]}  # noqa: E731
    return write_dicom(folder, array, syntax=f"{SYNTAX}.{syntax}", each=each, **tags)


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "int16"])
@pytest.mark.parametrize("syntax", ENCODERS)
def test_lossless_compressions(tmp_path, syntax, dtype):
    array = (voxels("uint16", (4, 12, 16)) % (200 if dtype == "uint8" else 4000)).astype(dtype)
    array = array - 100 if dtype == "int16" else array
    encode = ENCODERS[syntax]
    if dtype == "int16" and encode is not rle:
        encode = lambda plane: ENCODERS[syntax](plane.view(np.uint16))  # noqa: E731
    check(read_volume(compressed(tmp_path, array, syntax, encode)), array)


def test_a_lossy_compression_of_twelve_bits(tmp_path):
    x = np.add.outer(np.arange(32), np.arange(48))
    array = np.stack([(20 * x + 100 * z).astype(np.uint16) for z in range(4)])
    encode = partial(imagecodecs.jpeg8_encode, level=98, bitspersample=12)
    compressed(tmp_path, array, "4.51", encode, BitsStored=12, HighBit=11)
    np.testing.assert_allclose(read_volume(tmp_path).voxels, array, atol=20)


def test_pixels_that_are_floats(tmp_path):
    array = voxels("float32")
    for z, plane in enumerate(array):
        own = {"ImagePositionPatient": [0, 0, z], "SOPInstanceUID": f"1.2.{z}"}
        ds = dataset(np.zeros(plane.shape, np.uint8), BitsStored=None, HighBit=None, **own)
        del ds.PixelData, ds.PixelRepresentation
        ds.BitsAllocated, ds.FloatPixelData = 32, plane.tobytes()
        save_dicom(tmp_path / f"{z}.dcm", ds)
    check(read_volume(tmp_path), array)


@pytest.mark.parametrize("syntax", [DeflatedExplicitVRLittleEndian, ExplicitVRBigEndian])
def test_deflated_and_big_endian(tmp_path, syntax):
    array = voxels("int16")
    stored = array.byteswap() if syntax == ExplicitVRBigEndian else array
    check(read_volume(write_dicom(tmp_path, stored, syntax=syntax)), array)


def enhanced(count, times):
    """Functional groups of count slices, at each of a number of times."""
    groups = []
    for time, z in np.ndindex(times, count):
        groups += item(
            PlanePositionSequence=item(ImagePositionPatient=[1.0, 2.0, 3.0 * z]),
            FrameContentSequence=item(TemporalPositionIndex=time + 1, StackID="1"),
            PixelValueTransformationSequence=item(
                RescaleSlope=1 + z, RescaleIntercept=-5, RescaleType="US"
            ),
        )
    shared = item(
        PlaneOrientationSequence=item(ImageOrientationPatient=[1, 0, 0, 0, 1, 0]),
        PixelMeasuresSequence=item(PixelSpacing=[2.0, 0.5], SliceThickness=9.0),
    )
    values = {"SOPClassUID": ENHANCED_MR, "PixelSpacing": None, "ImageOrientationPatient": None}
    values |= {"PerFrameFunctionalGroupsSequence": groups}
    return values | {"SharedFunctionalGroupsSequence": shared}


@pytest.mark.parametrize("time", [None, "0", "1", "2"])
def test_many_frames_in_one_file(tmp_path, time):
    array = (voxels("uint16", (3, 4, 5, 7)) % 100).astype(np.uint16)
    ds = dataset(array.reshape(12, 5, 7), frames=12, **enhanced(4, 3))
    path = save_dicom(tmp_path / "a.dcm", ds)
    volume = read_volume(path, choice=Choice(time=time and str(int(time) + 1)))
    slopes = np.arange(1, 5)[:, None, None]
    expected = array[int(time or 0)].astype(int) * slopes - 5
    check(volume, expected, spacing=(0.5, 2, 3), origin=(1, 2, 0))
    assert [f"{c.kind} {c.name}" for c in volume.file.contents] == ["time 1", "time 2", "time 3"]


@pytest.mark.parametrize(
    ("tags", "units"),
    [
        ({"Modality": "CT"}, ""), (HU, "HU"), (HU | {"RescaleType": "US"}, ""),
        (HU | {"RescaleType": "mgml"}, "mgml"), ({"Modality": "PT", "Units": "BQML"}, "Bq/ml"),
    ],
)  # fmt: skip
def test_units_and_rescaling_of_each_slice(tmp_path, tags, units):
    array, slopes = voxels("int16") // 64, np.ones(6)
    if units == "Bq/ml":
        slopes = 1.5 + np.arange(6)
        tags = tags | {"each": lambda z: {"RescaleSlope": slopes[z], "RescaleIntercept": 0}}
    volume = read_volume(write_dicom(tmp_path, array, **tags))
    check(volume, array * slopes[:, None, None], rtol=1e-6, units=units)


def test_a_modality_s_table(tmp_path):
    array = (voxels("uint16") % 300).astype(np.uint16)
    entries = np.arange(256)[::-1].astype(np.uint16) * 3
    table = item(LUTDescriptor=[256, 10, 16], ModalityLUTType="OD", LUTData=entries.tobytes())
    table[0]["LUTData"].VR, table[0]["LUTDescriptor"].VR = "OW", "US"
    folder = write_dicom(tmp_path, array, ModalityLUTSequence=table)
    check(read_volume(folder), entries[np.clip(array.astype(int) - 10, 0, 255)])


def test_what_lies_in_unused_bits_is_left_out(tmp_path):
    array = (voxels("uint16") % 4096).astype(np.uint16)
    tags = {"BitsStored": 12, "HighBit": 11}
    folder = write_dicom(tmp_path / "mr", array | np.uint16(0xF000), **tags)
    check(read_volume(folder), array)
    signed = (array.astype(int) - 2048).astype(np.int16)
    folder = write_dicom(tmp_path / "ct", signed & np.int16(0x0FFF), **tags)
    check(read_volume(folder), signed)


def test_echoes_are_channels_and_repetitions_are_times(tmp_path):
    array = voxels("int16", (2, 3, 4, 5, 7))
    for echo, time in np.ndindex(2, 3):
        tags = {"EchoNumbers": echo + 1, "TemporalPositionIdentifier": time + 1}
        write_dicom(tmp_path, array[echo, time], start=100 * echo + 10 * time, **tags)
    volume = read_volume(tmp_path, choice=Choice(time="3", channel="echo 2"))
    check(volume, array[1, 2])
    names = [f"{content.kind} {content.name}" for content in volume.file.contents]
    assert names == ["time 1", "time 2", "time 3", "channel echo 1", "channel echo 2"]


def test_repetitions_that_nothing_identifies_are_told_by_their_numbers(tmp_path):
    array = voxels("int16", (2, 4, 5, 7))
    for time in range(2):
        write_dicom(tmp_path, array[time], start=10 * time)
    check(read_volume(tmp_path, choice=Choice(time="1")), array[1])


def test_localizers_previews_and_copies_are_left_out(tmp_path):
    array = voxels("int16")
    folder = write_dicom(tmp_path / "ct", array, SeriesDescription="thorax", SeriesNumber=4)
    axes = [0, 1, 0, 0, 0, -1]
    kind = ["ORIGINAL", "PRIMARY", "LOCALIZER"]
    write_dicom(folder, array[:1], start=50, ImageOrientationPatient=axes, ImageType=kind)
    write_dicom(folder, array[:2, :2, :2], start=60)
    shutil.copy(folder / "000.dcm", folder / "copy of 000.dcm")
    (folder / "._000.dcm").write_bytes(b"\0\5\x16\7" + b"Mac OS X" * 40)
    check(read_volume(folder), array, "as another were left out: 1|'4 thorax' is read")


def test_images_beside_one_another_are_two_volumes(tmp_path):
    array = voxels("int16", (2, 4, 5, 7))
    for side in range(2):
        places = [[100.0 * side, 0, 3 * z] for z in range(4)]
        write_dicom(tmp_path / "mr", array[side], positions=places, start=10 * side)
    for side in range(2):
        volume = read_volume(tmp_path / "mr", choice=Choice(series=str(side)))
        check(volume, array[side])


@pytest.mark.parametrize(("places", "tags", "spacing", "said"), [
    ((0, 3, 6, 15, 18, 21), {}, 3, "2 slices between slices 2 and 3 (at 6 and 15 mm)"),
    ((0, 1, 2, 3, 8, 13), {}, 1, "The slices are 1 to 5 mm apart"),
    (None, {"SliceThickness": 4}, 4, "no position"),
    (None, {"each": lambda z: {"SliceLocation": 2.5 * (6 - z)}}, 2.5, ""),
])  # fmt: skip
def test_places_that_are_odd_are_said(tmp_path, places, tags, spacing, said):
    at = [None] * 6 if places is None else [[0, 0, z] for z in places]
    volume = read_volume(write_dicom(tmp_path / "mr", voxels("int16"), positions=at, **tags))
    expected = voxels("int16")[:: -1 if "each" in tags else 1]
    check(volume, expected, said, spacing=(0.5, 2, spacing))
    assert any(isinstance(note, Caution) for note in volume.notes) == ("slices" in said)


PLACE = {"ImagePositionPatient": [1, 2, 3]}
DOSE = {"DoseGridScaling": 0.001, "DoseUnits": "GY", "Modality": "RTDOSE"}
OFFSETS = {"GridFrameOffsetVector": [0.0, 2.5, 5, 7.5, 10, 12.5]}


@pytest.mark.parametrize(("tags", "factor", "facts"), [
    ({"SpacingBetweenSlices": 4.0}, 1, {"spacing": (0.5, 2, 4)}),
    (DOSE | OFFSETS, 0.001, {"units": "Gy", "spacing": (0.5, 2, 2.5)}),
    ({"BitsAllocated": 1, "BitsStored": 1, "HighBit": 0}, 1, {}),
])  # fmt: skip
def test_frames_without_functional_groups(tmp_path, tags, factor, facts):
    array = voxels("uint16", (6, 5, 7))
    ds = dataset(array, frames=6, **PLACE, **tags)
    if "BitsAllocated" in tags:
        # A segmentation, packed across its images.
        array = array > 30000
        packed = np.packbits(array.ravel(), bitorder="little")
        ds.PixelData = np.append(packed, np.zeros(len(packed) % 2, np.uint8)).tobytes()
    check(read_volume(save_dicom(tmp_path / "a.dcm", ds)), array * factor, rtol=1e-5, **facts)


@pytest.mark.parametrize(("syntax", "encode", "said"), [
    ("4.102", lambda plane: b"?", "compressed as MPEG-4"),
    ("4.80", lambda plane: imagecodecs.jpegls_encode(plane)[:3000], "stop before the end"),
    ("4.80", lambda _: imagecodecs.jpegls_encode(LARGE), "another size than its tags"),
])  # fmt: skip
def test_compressed_pixels_that_are_refused(tmp_path, syntax, encode, said):
    refused(compressed(tmp_path, voxels("uint16", (3, 50, 70)), syntax, encode), said)
