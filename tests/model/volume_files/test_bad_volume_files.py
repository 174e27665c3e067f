"""Every bad file gets one clear sentence, and nothing else: no noise, no crash, no noise data."""

import contextlib
import gzip
import os
import re
import struct
import zlib
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import tifffile
import volume_writers as files
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from test_containers import hdf5, netcdf
from volume_writers import check, refused, voxels
from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow
from vtkmodules.vtkIOXML import vtkXMLImageDataReader

from model.errors import VolumeError
from model.volume_files import Choice, RawLayout, checks, read_volume

ARRAY = voxels()
FLAT = voxels(shape=(5, 7))
SLICE = Path(__file__).parent / "cases" / "folder" / "gap" / "s0001.tif"


def refusal(path, **options):
    """The one sentence with the file's name that reading must raise, and suggested settings."""
    with pytest.raises(VolumeError) as caught:
        read_volume(path, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(path)) or path.is_dir() or path.name in message
    assert message.endswith(".")
    assert caught.value.__suppress_context__ or caught.value.__context__ is None
    return f"{message} {caught.value.suggested}" if caught.value.suggested else message


def replaced(path, old, new):
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new))
    return path


def by(write, suffix, *arguments, change=None, **options):
    """A builder of a file by a writer, in which some bytes become others."""

    def build(path):
        path = write(path.with_suffix(suffix), *arguments, **options)
        return path if change is None else replaced(path, *change)

    return build


def nrrd(*fields, array=ARRAY, **options):
    return by(files.write_nrrd, ".nrrd", array, *fields, **options)


def nrrd_header(text):
    return named("a.nrrd", b"NRRD0004\n" + text.encode() + b"\n\n" + ARRAY.tobytes())


def metaimage(*fields, **options):
    return by(files.write_metaimage, ".mha", ARRAY, *fields, **options)


def nifti(offset, dtype, value):
    changes = {offset: (dtype, value)}
    return lambda path: files.patched(files.write_itk(path.with_suffix(".nii"), ARRAY), changes)


def vti(*change, **options):
    return by(files.write_vti, ".vti", ARRAY, change=change, **options)


def vti_blocks(numbers):
    """Change the numbers that head a compressed array."""

    def build(path):
        path = files.write_vti(path.with_suffix(".vti"), ARRAY, compressor="ZLib")
        return files.patched(path, {path.read_bytes().index(b"\n   _") + 5: ("<u4", numbers)})

    return build


def legacy(*change):
    return by(files.write_legacy, ".vtk", ARRAY, change=change)


def tiff(pages, **options):
    return by(files.write_tiff, ".tif", pages, **options)


def half_tiled(path):
    """Each page has a tile's width besides its strips."""
    path = tiff(ARRAY, extratags=[(60000, 3, 1, 16, True)])(path)
    return replaced(path, struct.pack("<HH", 60000, 3), struct.pack("<HH", 322, 3))


def short_strip(path):
    path = tiff(ARRAY)(path)
    with tifffile.TiffFile(path) as file:
        strip = file.pages[0].tags[279]
    return files.patched(path, {strip.offset + 8: ("<u4", 3)})


def circular(path):
    path = tiff(ARRAY)(path)
    with tifffile.TiffFile(path) as file:
        first, last = file.pages[0], file.pages[-1]
        after = last.offset + 2 + 12 * len(last.tags)
    return files.patched(path, {after: ("<u4", first.offset)})


def named(name, content):
    def build(path):
        path = path.parent / name
        path.write_bytes(content)
        return path

    return build


def packed(path):
    return named(f"{path.name}.gz", gzip.compress(path.read_bytes()))(path)


def itk(suffix, array):
    return by(files.write_itk, suffix, array)


MHD = b"ObjectType = Image\nNDims = 3\n"
ARRAY_3D = "type: short\ndimension: 3\nencoding: raw\n"
EMPTY_VTI = (
    b'<VTKFile type="ImageData" version="0.1" byte_order="LittleEndian"><ImageData '
    b'WholeExtent="0 2 0 2 0 2" Origin="0 0 0" Spacing="1 1 1">'
    b'<Piece Extent="0 2 0 2 0 2"><PointData/><CellData/></Piece></ImageData></VTKFile>'
) + b" " * 99
APPENDED = b"  <AppendedData encoding="
COLORS = voxels(shape=(5, 7, 3))
WITH_NAN = np.full((3, 4, 5), np.nan, np.float32)

BAD_FILES = {
    # Flat images.
    "flat nrrd": (itk(".nrrd", FLAT), r"flat image of 7 x 5"),
    "flat tif": (tiff([FLAT]), r"flat image of 7 x 5 x 1"),
    "one slice vti": (by(files.write_vti, ".vti", FLAT[None]), r"flat .* 7 x 5 x 1"),
    "rgb image nrrd": (nrrd("kinds: RGB-color domain domain", array=COLORS),
        r"flat image of 7 x 5"),
    # Sizes that cannot be.
    "negative nrrd": (nrrd_header(ARRAY_3D + "sizes: 7 -5 6"), r"7 x -5 x 6, which cannot be"),
    "negative mha": (metaimage(change=(b"DimSize = 7 5", b"DimSize = 7 -5")),
        r"7 x -5 x 6, which cannot be"),
    "negative nii": (nifti(44, "<i2", -5), r"dimension 2 is negative"),
    "zero vti": (vti(b"0 6 0 4 0 5", b"0 6 0 -1 0 5"), r"7 x 0 x 6, which cannot be"),
    "negative vtk": (legacy(b"DIMENSIONS 7 5 6", b"DIMENSIONS 7 -5 6"), r"-5 x 6, which cannot be"),
    "five axes nrrd": (nrrd(array=voxels(shape=(2, 2, 2, 2, 2))), r"of 5 axes"),
    # More than the memory.
    "huge nrrd": (nrrd_header(ARRAY_3D + "sizes: 100000 100000 100000"), r"1819\.0 TiB.*memory"),
    "huge gzip nrrd": (nrrd_header(ARRAY_3D.replace("raw", "gzip") + "sizes: 100000 100000 100000"),
        r"100000 x 100000 x 100000 voxels, 1819\.0 TiB"),
    "overlong nrrd": (nrrd_header(ARRAY_3D + f"sizes: {'9' * 5000} 2 2"), r"malformed 'sizes'"),
    "huge mha": (metaimage(change=(b"= 7 5 6", b"= 100000 100000 100000")),
        r"100000 x 100000 x 100000 voxels.*memory"),
    "huge nii": (nifti(42, "<i2", [32000, 32000, 32000]), r"32000 x 32000 x 32000.*memory"),
    "huge vti": (vti(b"0 6 0 4 0 5", b"0 99999 0 99999 0 99999"), r"100000 x .*memory"),
    "huge raw": (named("a_100000x100000x100000_float32.raw", b"1"), r"memory"),
    # More than the file, though it would fit the memory.
    "long nrrd": (nrrd_header(ARRAY_3D + "sizes: 7 5 600"), r"420 of the 42000 bytes"),
    "long gzip nrrd": (nrrd("encoding: gzip", data=gzip.compress(ARRAY[:3].tobytes())),
        r"210 of the 420 bytes"),
    "short gzip nrrd": (nrrd("encoding: gzip", data=gzip.compress(ARRAY.tobytes() * 2)),
        r"more voxels than its header says"),
    "long mha": (metaimage(change=(b"DimSize = 7 5 6", b"DimSize = 7 5 600")),
        r"420 of the 42000 bytes"),
    "long nii": (nifti(46, "<i2", 600), r"420 of the 42000 bytes"),
    "long nii.gz": (lambda p: packed(nifti(46, "<i2", 600)(p)), r"truncated"),
    "long vti": (vti(b"0 6 0 4 0 5", b"0 6 0 4 0 599"), r"truncated"),
    "long vtk": (legacy(b"7 5 6", b"7 5 600"), r"truncated"),
    "long raw": (named("a_7x5x6_uint16.raw", b"1" * 419), r"has 419 .*It is truncated"),
    "headed raw": (named("a_7x5x6_uint16.raw", b"1" * 932),
        r"7 x 5 x 6 voxels of uint16.*512 bytes too many\. A header\?.*offset=512"),
    # Damaged, foreign and incomplete headers.
    "foreign nrrd": (named("a.nrrd", b"\x89PNG" + b"?" * 500), r"not a NRRD file"),
    "foreign mha": (named("a.mha", os.urandom(500)), r"not a MetaImage file"),
    "foreign nii": (named("a.nii", b"?" * 500), r"not a NIfTI file"),
    "foreign vti": (named("a.vti", b"<html></html>"), r"not VTK image data"),
    "foreign vtk": (named("a.vtk", b"?" * 500), r"not a legacy VTK file"),
    "polygons in vtk": (
        named("a.vtk", b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 0 float\n"),
        r"holds polydata, not structured_points"),
    "foreign tif": (named("a.tif", b"?" * 500), r"not a TIFF file"),
    "foreign dcm": (named("a.dcm", b"?" * 500), r"not a DICOM file"),
    "nameless raw": (named("a.raw", b"?" * 500), r"into the name.*'raw': '256x256x110_uint8'"),
    "foreign npy": (named("a.npy", b"?" * 2000), r"NumPy"),
    "foreign h5": (named("a.h5", b"?" * 2000), r"HDF5"),
    # Kinds that are named, with what converts them.
    "Zeiss": (named("a.czi", b"ZISRAWFILE"), r"Fiji"),
    "Nikon": (named("a.nd2", b"?"), r"nd2"),
    "unstructured": (named("a.vtu", b"<VTKFile>"), r"Resample To Image"),
    "pickle": (named("a.pkl", b"?"), r"numpy.save"),
    "archive": (named("a.dat", b"PK\x03\x04"), r"an archive"),
    "CDF-5": (named("a.nc", b"CDF\x05\0\0"), r"CDF-5.*nccopy"),
    "HDF4": (named("a.hdf", b"\x0e\x03\x13\x01" * 9), r"an HDF4 file.*h4toh5"),
    "MATLAB 5": (named("a.mat", b"MATLAB 5.0 MAT-file" * 9), r"MATLAB's old format.*-v7.3"),
    "unknown": (named("a.xyz", b"?" * 500), r"'\.xyz' are not read here.*NRRD"),
    "no suffix": (named("volume", b"?" * 500), r"'volume' are not read here.*convert this"),
    "empty": (named("a.nrrd", b""), r"empty \(0 bytes\)"),
    "nrrd without type": (nrrd_header("dimension: 3\nsizes: 7 5 6"), r"no 'type'"),
    "nrrd without sizes": (nrrd_header("dimension: 3\ntype: short"), r"no 'sizes'"),
    "nrrd of other dimension": (nrrd_header(ARRAY_3D + "sizes: 7 5"), r"malformed 'sizes'"),
    "nrrd without end": (named("a.nrrd", b"NRRD0004\ntype: short\n"), r"its header has no end"),
    "nrrd endian": (nrrd("endian: middle"), r"malformed 'endian'"),
    "nrrd directions": (nrrd("space directions: (1,0,0) (0,1,0)"), r"malformed 'space directions'"),
    "nrrd spacings": (nrrd("spacings: 1 2"), r"malformed 'spacings'"),
    "nrrd skip": (nrrd("byte skip: -7"), r"malformed 'line skip or byte skip'"),
    "nrrd block type": (nrrd(kind="block"), r"NRRD type 'block' cannot be read"),
    "nrrd ascii": (nrrd("encoding: ascii"), r"'ascii' cannot be read here; save it as raw or gzip"),
    "nrrd list": (nrrd("data file: LIST\na.raw"), r"several data files"),
    "nrrd without data": (nrrd("data file: b.raw"), r"data file b\.raw is missing"),
    "nrrd bad gzip": (nrrd("encoding: gzip", data=b"?" * 99), r"compressed stream is invalid"),
    "nrrd wrong sum": (nrrd("encoding: gzip", data=gzip.compress(ARRAY.tobytes())[:-8] + b"?" * 8),
        r"compressed stream is invalid"),
    "mha without size": (named("a.mhd", MHD + b"ElementDataFile = LOCAL\n"),
        r"has no 'DimSize'"),
    "mha type": (metaimage(kind="MET_STRING"), r"'MET_STRING' cannot be read"),
    "mha ascii": (metaimage("BinaryData = False"), r"ASCII voxels cannot be read"),
    "mha list": (metaimage(file="LIST"), r"several data files"),
    "mha without data": (metaimage(file="b.raw"), r"data file b\.raw is missing"),
    "mha spacing": (metaimage("ElementSpacing = 1 2"), r"malformed 'ElementSpacing'"),
    "mha matrix": (metaimage("TransformMatrix = 1 0 0 0"), r"malformed 'TransformMatrix'"),
    "mha bad zlib": (metaimage("CompressedData = True", data=b"?" * 99), r"stream is invalid"),
    "mha cut zlib": (metaimage("CompressedData = True", data=zlib.compress(ARRAY.tobytes())[:-2]),
        r"compressed stream stops before the end"),
    "nii type": (nifti(70, "<i2", 1), r"voxels of such a data type cannot be read"),
    "vti extent": (vti(b"0 6 0 4 0 5", b"0 6 0 4"), r"no extent of six numbers"),
    "vti syntax": (vti(b"<PointData", b"<PointDate"), r"VTK says"),
    "vti without array": (named("a.vti", EMPTY_VTI), r"holds no values"),
    "vti format": (vti(b'"appended"', b'"appendix"', compressor="ZLib"),
        r"does not say where its values are"),
    "vti appended twice": (vti(APPENDED, APPENDED + b'"raw">\n' + APPENDED, compressor="LZ4"),
        r"underscore"),
    "vti cut": (vti(b"</VTKFile>", b""), r"closing tag is missing"),
    "vti many blocks": (vti_blocks([1 << 31, 32768, 420]), r"claims 2147483648 compressed blocks"),
    "vti long block": (vti_blocks([1, 32768, 420, 1 << 30]), r"blocks are longer than the file"),
    "vti huge blocks": (vti_blocks([3, 1 << 31, 0]), r"sizes of its compressed blocks cannot be"),
    "vtk kind": (legacy(b"STRUCTURED_POINTS", b"RECTILINEAR_GRID"), r"holds rectilinear_grid"),
    "vtk keyword": (legacy(b"SCALARS", b"SCALERS"), r"."),
    "vtk without size": (legacy(b"DIMENSIONS", b"DIMENSION"), r"no dimensions"),
    # Kinds that are not read.
    "tif half tiled": (half_tiled, r"damaged, or of another format"),
    "tif complex": (tiff(ARRAY.astype("c8")), r"TIFF of complex64 voxels cannot be read here"),
    "tif in a circle": (circular, r"circular reference"),
    "tif of several": (lambda _: SLICE, r"one of the 10 slices in its folder, open the folder"),
    "tif pages differ": (tiff([FLAT, FLAT.T]), r"slices differ in size, type or storage"),
    "tif short strip": (short_strip, r"fewer pixels than its size says"),
    # Voxels that show nothing.
    "all nan": (itk(".nrrd", WITH_NAN), r"every voxel is NaN or infinite"),
    "constant": (itk(".nrrd", np.full((3, 4, 5), 7, np.int16)), r"every voxel has the value 7"),
    "one, and NaN": (itk(".nrrd", np.array([[[7, np.nan], [7, 7]]] * 2)), "the value 7"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_file(tmp_path, capfd, case):
    build, expected = BAD_FILES[case]
    path = build(tmp_path / "a.file")
    message = refusal(path)
    assert re.search(expected, message), message
    assert capfd.readouterr() == ("", "")


def test_missing_file(tmp_path):
    for name in ("a.nrrd", "folder/a.nrrd"):
        assert "there is no such file or folder" in refusal(tmp_path / name)


def test_unreadable_file(tmp_path, monkeypatch):
    path = files.write_itk(tmp_path / "a.nrrd", ARRAY)
    path.chmod(0)
    if os.access(path, os.R_OK):  # root reads everything, so play the system's refusal
        refused_here = PermissionError(13, "Permission denied", str(path))
        monkeypatch.setattr("pathlib.Path.open", Mock(side_effect=refused_here))
    message = refusal(path)
    assert "Permission denied" in message
    assert "check the path and your permissions" in message


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_is_refused_at_once(tmp_path):
    path = tmp_path / "a.nrrd"
    os.mkfifo(path)
    assert "neither a file nor a folder" in refusal(path)


def test_memory_that_runs_out_while_reading(tmp_path, monkeypatch):
    path, exhausted = files.write_itk(tmp_path / "a.nrrd", ARRAY), Mock(side_effect=MemoryError)
    monkeypatch.setattr("model.volume_files.nrrd_metaimage.read_block", exhausted)
    assert "not enough free memory" in refusal(path)


def test_a_system_that_does_not_tell_its_memory(tmp_path, monkeypatch):
    monkeypatch.setattr(checks, "physical_memory", lambda: None)
    path = files.write_itk(tmp_path / "a.nrrd", ARRAY)
    check(read_volume(path), ARRAY)


def test_vtk_speaks_again_after_a_bad_file(tmp_path, capfd):
    window, verbosity = vtkOutputWindow.GetInstance(), vtkLogger.GetCurrentVerbosityCutoff()
    refusal(replaced(files.write_legacy(tmp_path / "a.vtk", ARRAY), b"7 5 6", b"7 5 7"))
    assert vtkOutputWindow.GetInstance() is window
    assert vtkLogger.GetCurrentVerbosityCutoff() == verbosity
    assert capfd.readouterr().err == ""
    vtkXMLImageDataReader().Update()
    assert "vtkXMLImageDataReader" in capfd.readouterr().err


# --- folders ------------------------------------------------------------------------------


def filled(folder, **contents):
    for name, content in contents.items():
        (folder / name.replace("_", ".")).write_bytes(content)


FOLDERS = {
    "empty": (filled, "no DICOM or TIFF slices"),
    "a text": (lambda f: filled(f, notes_md=b"hello"), "no DICOM or TIFF slices"),
    "pictures": (lambda f: filled(f, **{f"{k}_png": b"\x89PNG" for k in range(3)}),
        r"holds 3 images \(\.png\), which are not read here"),
    "folders": (
        lambda f: [(f / "brain").mkdir(), files.write_tiff(f / "brain" / "a.tif", [FLAT])],
        "such as brain; open one of them"),
    "volumes": (lambda f: files.write_itk(f / "a.nrrd", ARRAY),
        r"volumes, such as a\.nrrd; open one of them"),
    "unlike slices": (
        lambda f: [files.write_tiff(f / f"{rows}.tif", [FLAT[:rows]]) for rows in (4, 5)],
        "differ in size, type or storage"),
    "a slice and a stack": (
        lambda f: [files.write_tiff(f / f"{pages}.tif", [FLAT] * pages) for pages in (1, 2)],
        r"2\.tif: this slice of a stack has 2 pages"),
    "one slice": (lambda f: files.write_dicom(f, ARRAY[:1]), "flat image of 7 x 5 x 1"),
    "colours": (lambda f: files.write_dicom(f, voxels("uint8"), SamplesPerPixel=3), "in colour"),
    "n5": (lambda f: filled(f, attributes_json=b'{"n5": "4.0.0"}'), "N5 container.*OME-Zarr"),
}  # fmt: skip


@pytest.mark.parametrize("case", FOLDERS)
def test_bad_folder(tmp_path, case):
    fill, expected = FOLDERS[case]
    fill(tmp_path)
    assert re.search(expected, refusal(tmp_path))


BITS = b"(\0\x01\x01US\x02\0"

DICOM_CHANGES = {
    # What becomes of the bytes of the third of some slices.
    "truncated pixels": (lambda d: d[:-30], r"002\.dcm: the file is truncated"),
    "no pixels": (lambda d: d[: d.index(b"\xe0\x7f\x10\x00")], r"002\.dcm: .*it has no pixels"),
    "cut tag": (lambda d: d[:500], r"002\.dcm: the file is truncated"),
    "bits stored": (lambda d: d.replace(BITS + b"\x10", BITS + b"\x13"), r"bits stored exceed"),
    "compressed": (lambda d: d.replace(b"1.2.840.10008.1.2.1\0", b"1.2.840.10008.9.9.9\0"),
        r"pixels compressed as .*gdcmconv"),
    "same place": (lambda d: d.replace(b"10.0\\-20.0\\36.0", b"10.0\\-20.0\\30.0"),
        r"one position \(000\.dcm and 002\.dcm\), and no field"),
}  # fmt: skip


@pytest.mark.parametrize("case", DICOM_CHANGES)
def test_bad_dicom(tmp_path, case):
    change, expected = DICOM_CHANGES[case]
    folder = files.write_dicom(tmp_path / "ct", ARRAY.astype(np.int16))
    whole = (folder / "002.dcm").read_bytes()
    assert change(whole) != whole
    (folder / "002.dcm").write_bytes(change(whole))
    refused(folder, expected)


# --- options ------------------------------------------------------------------------------


@pytest.mark.parametrize(("shape", "component", "text"), [
    ((4, 5, 6, 3), "3", "no component 3; choose 0 to 2"),
    ((4, 5, 6), "1", "the volume has one, number 0"),
])  # fmt: skip
def test_component_that_is_not_there(tmp_path, shape, component, text):
    array = voxels("float32", shape)
    path = files.write_itk(tmp_path / "a.mha", array, vector=len(shape) > 3)
    assert text in refusal(path, choice=Choice(component=component))


def test_layouts_that_cannot_be():
    with pytest.raises(VolumeError, match="'complex64' is not a scalar type"):
        RawLayout((2, 2, 2), "complex64")
    with pytest.raises(VolumeError, match="'middle' is not a byte order"):
        RawLayout((2, 2, 2), "uint8", "middle")


# --- truncation ---------------------------------------------------------------------------

TRUNCATED = {
    "raw.nrrd": files.write_itk,
    "gzip.nrrd": lambda path, array: files.write_itk(path, array, compressed=True),
    "raw.mha": files.write_itk,
    "zlib.mha": lambda path, array: files.write_itk(path, array, compressed=True),
    "raw.nii": files.write_itk,
    "gzip.nii.gz": files.write_itk,
    "appended.vti": files.write_vti,
    "zlib.vti": lambda path, array: files.write_vti(path, array, compressor="ZLib"),
    "base64.vti": lambda path, array: files.write_vti(path, array, mode="Binary"),
    # ASCII legacy files are left out: "358" cut to "35" is still a number.
    "binary.vtk": files.write_legacy,
    "pages.tif": files.write_tiff,
    "itk.tif": files.write_itk,
    "a.npy": files.write_npy,
    "a.npz": files.write_npz,
    "a.h5": hdf5,
    "a.nc": lambda path, array: netcdf(path, array.astype(np.int32)),
    "a.dcm": lambda path, array: files.save_dicom(path, files.dataset(array, frames=len(array))),
    "a_7x5x6_uint16.raw": lambda path, array: path.write_bytes(array.tobytes()) and path,
}


@pytest.fixture(scope="module")
def whole_files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    return {name: write(folder / name, ARRAY).read_bytes() for name, write in TRUNCATED.items()}


@pytest.mark.parametrize("name", TRUNCATED)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0, 1, exclude_max=True))
@example(share=0.999999)
@example(share=0.98)
def test_a_file_cut_anywhere_is_refused_or_reads_equal(tmp_path, whole_files, name, share):
    whole = whole_files[name]
    path = tmp_path / name
    path.write_bytes(whole[: int(share * len(whole))])
    with contextlib.suppress(VolumeError):
        check(read_volume(path), ARRAY)


def test_pixels_that_cannot_be_unpacked(tmp_path):
    array = np.arange(256 * 64, dtype=np.uint16).reshape(4, 64, 64)
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, array, compression="zlib", photometric="minisblack")
    content = bytearray(path.read_bytes())
    content[40:80] = b"\xff" * 40
    path.write_bytes(content)
    refused(path, r"unpacked|damaged")


@pytest.mark.parametrize("kind", ["dicom", "tiff"])
def test_no_folder_of_slices_leads_elsewhere(tmp_path, kind):
    elsewhere, folder = tmp_path / "elsewhere", tmp_path / "data"
    for place in (folder, elsewhere):
        place.mkdir()
        if kind == "dicom":
            files.write_dicom(place, voxels())
        for number in range(3 if kind == "tiff" else 0):
            files.write_tiff(place / f"{number}.tif", [FLAT])
    expected = read_volume(folder).voxels
    # A link inside the folder, and one without a slice's name, harm nobody.
    (first, *_) = sorted(folder.iterdir())
    (folder / "sub").mkdir()
    first.rename(folder / "sub/kept")
    first.symlink_to("sub/kept")
    (folder / "notes").symlink_to(sorted(elsewhere.iterdir())[0])
    check(read_volume(folder), expected)
    stranger = sorted(elsewhere.iterdir())[0]
    (folder / f"z{stranger.suffix}").symlink_to(stranger)
    refused(folder, "a link that leads out of its folder")
