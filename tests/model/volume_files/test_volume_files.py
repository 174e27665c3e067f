"""Every format, written by something independent of our readers, comes back equal."""

import bz2
import gzip
import hashlib
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from volume_writers import (
    ALL_TYPES,
    INTEGER_TYPES,
    ORIGIN,
    SPACING,
    voxels,
    write_dicom,
    write_itk,
    write_legacy,
    write_metaimage,
    write_nrrd,
    write_tiff,
    write_vti,
)

from model.volume_files import SUFFIXES, RawLayout, describe, read_volume

ROOT = Path(__file__).parents[3]
SHIPPED = {
    "reacting_jet_temperature_112x112x192_float32.nrrd": (
        "reacting jet temperature",
        (112, 112, 192),
        (1.0, 1.0, 1.0),
        "3804755c4ea48bdc14dc1f34b9337680c4bb65143574bea81f22e308a9fdb3af",
    ),
    "lidc_chest_256x256x133_uint8.nrrd": (
        "lidc chest",
        (256, 256, 133),
        (1.40625, 1.40625, 2.5),
        "42bcbf7ad0af70375afd096a824ebdeb39b33ba5848fc7717819a8c160d8e444",
    ),
}


def assert_volume(volume, array, spacing=SPACING, origin=ORIGIN):
    assert volume.scalars.dtype == array.dtype
    assert volume.scalars.dtype.isnative
    assert volume.scalars.flags.c_contiguous
    np.testing.assert_array_equal(volume.scalars, array)
    assert volume.spacing == pytest.approx(spacing)
    assert volume.origin == pytest.approx(origin)
    assert all(type(number) is float for number in volume.spacing + volume.origin)


# --- what ships ---------------------------------------------------------------------------


@pytest.mark.parametrize("file", SHIPPED)
def test_shipped_volumes_have_the_voxels_that_were_published(file):
    name, dimensions, spacing, sha256 = SHIPPED[file]
    volume = read_volume(ROOT / "resources" / "volumes" / file)
    assert (volume.name, volume.dimensions, volume.spacing) == (name, dimensions, spacing)
    assert volume.notes == ()
    assert hashlib.sha256(volume.scalars.tobytes()).hexdigest() == sha256


def test_importing_the_readers_imports_no_library_of_a_format():
    names = ("vtkmodules", "tifffile", "pydicom", "nibabel", "mrcfile", "h5py", "zarr", "scipy")
    code = f"import sys, model.volume_files; print(any(n in sys.modules for n in {names}))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.strip() == "False"


# --- NRRD ---------------------------------------------------------------------------------


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("dtype", ALL_TYPES)
def test_nrrd(tmp_path, dtype, compressed):
    path = write_itk(tmp_path / "a.nrrd", voxels(dtype), compressed=compressed)
    volume = read_volume(path)
    assert_volume(volume, voxels(dtype))
    assert volume.notes == ()


@pytest.mark.parametrize("dtype", ["uint16", "float64"])
def test_detached_nrrd(tmp_path, dtype):
    assert_volume(read_volume(write_itk(tmp_path / "a.nhdr", voxels(dtype))), voxels(dtype))


ENCODINGS = {
    "raw": bytes,
    "gzip": gzip.compress,
    "gz": lambda data: gzip.compress(data[:99]) + gzip.compress(data[99:]),
    "bzip2": bz2.compress,
    "bz2": lambda data: bz2.compress(data[:99]) + bz2.compress(data[99:]),
}


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("endian", ["big", "little"])
def test_nrrd_byte_orders_and_encodings(tmp_path, endian, encoding):
    array = voxels()
    data = ENCODINGS[encoding](array.astype(f"{'>' if endian == 'big' else '<'}u2").tobytes())
    path = tmp_path / "a.nrrd"
    write_nrrd(
        path, array, f"endian: {endian}", f"encoding: {encoding}", "spacings: 0.5 2 3", data=data
    )
    assert_volume(read_volume(path), array, origin=(0, 0, 0))


@pytest.mark.parametrize(
    "line_ending_and_skip", ["crlf", "byte skip: 5", "byteskip: -1", "line skip: 2"]
)
def test_nrrd_skips_and_line_endings(tmp_path, line_ending_and_skip):
    array = voxels()
    before = {"byte skip: 5": b"12345", "byteskip: -1": b"?" * 77, "line skip: 2": b"a\nbc\n"}
    skip = line_ending_and_skip if line_ending_and_skip in before else "# none"
    data = before.get(line_ending_and_skip, b"") + array.tobytes()
    path = write_nrrd(tmp_path / "a.nrrd", array, "encoding: raw", skip, data=data)
    if line_ending_and_skip == "crlf":
        header, _, payload = path.read_bytes().partition(b"\n\n")
        path.write_bytes(header.replace(b"\n", b"\r\n") + b"\r\n\r\n" + payload)
    np.testing.assert_array_equal(read_volume(path).scalars, array)


def test_nrrd_with_few_columns_is_no_vector(tmp_path):
    array = voxels(shape=(6, 5, 3))
    volume = read_volume(write_nrrd(tmp_path / "a.nrrd", array, "encoding: raw"))
    assert_volume(volume, array, (1, 1, 1), (0, 0, 0))
    assert volume.notes == ("The file gives no voxel spacing; 1 is assumed.",)


@pytest.mark.parametrize(
    ("directions", "notes"),
    [
        ("(0.5,0,0) (0,2,0) (0,0,3)", []),
        ("(-0.5,0,0) (0,-2,0) (0,0,3)", ["turned"]),
        ("(0,2,0) (3,0,0) (0,0,0.5)", ["left-handed", "turned"]),
        ("(-0.5,0,0) (0,2,0) (0,0,3)", ["left-handed", "turned"]),
        ("(0.3,0.4,0) (-1.6,1.2,0) (0,0,3)", ["oblique"]),
        ("(0,0,0) (0,2,0) (0,0,nan)", ["x, z is unusable"]),
    ],
)
def test_nrrd_directions_keep_the_index_frame(tmp_path, directions, notes):
    array = voxels()
    path = write_nrrd(
        tmp_path / "a.nrrd",
        array,
        "encoding: raw",
        "space: left-posterior-superior",
        f"space directions: {directions}",
        "space origin: (10,-20,30)",
        'sample units: "K"',
    )
    volume = read_volume(path)
    lengths = {"(0,2,0) (3,0,0) (0,0,0.5)": (2, 3, 0.5), "(0,0,0) (0,2,0) (0,0,nan)": (1, 2, 1)}
    spacing, origin = lengths.get(directions, SPACING), ORIGIN
    if "left-handed" in notes:
        array = array[::-1]
        origin = (*ORIGIN[:2], ORIGIN[2] + (len(array) - 1) * spacing[2])
    assert_volume(volume, array, spacing, origin)
    assert volume.units == "K"
    assert len(volume.notes) == len(notes)
    for note, word in zip(volume.notes, notes, strict=True):
        assert word in note


@pytest.mark.parametrize("space", ["LAS", "3D-left-handed"])
def test_a_left_handed_space_with_plain_axes_is_not_shown_mirrored(tmp_path, space):
    fields = ["encoding: raw", f"space: {space}", "space directions: (1,0,0) (0,1,0) (0,0,2)"]
    volume = read_volume(write_nrrd(tmp_path / "a.nrrd", voxels(), *fields))
    assert "left-handed" in volume.notes[0]
    np.testing.assert_array_equal(volume.voxels, voxels()[::-1])
    assert volume.origin == (0, 0, 2 * (len(voxels()) - 1))


def test_nrrd_without_an_order_of_bytes_says_what_is_assumed(tmp_path):
    path = write_nrrd(tmp_path / "a.nrrd", voxels(), "encoding: raw", "spacings: 1 1 1")
    path.write_bytes(path.read_bytes().replace(b"endian: little\n", b""))
    assert "little-endian is assumed" in " ".join(read_volume(path).notes)


def test_nrrd_spacing_by_the_ends_of_the_axes(tmp_path):
    nz, ny, nx = voxels().shape
    ends = f"axis maxs: {0.5 * (nx - 1)} {2 * (ny - 1)} {3 * nz}"
    fields = ["encoding: raw", "axis mins: 0 0 0", ends, "centers: node node cell"]
    volume = read_volume(write_nrrd(tmp_path / "a.nrrd", voxels(), *fields))
    assert volume.spacing == pytest.approx((0.5, 2, 3))
    assert "no voxel spacing" not in " ".join(volume.notes)


def test_nrrd_axes_in_different_units_become_one(tmp_path):
    fields = ["encoding: raw", "spacings: 500 0.8 2", 'units: "um" "mm" "mm"']
    volume = read_volume(write_nrrd(tmp_path / "a.nrrd", voxels(), *fields))
    assert volume.spacing == pytest.approx((500, 800, 2000))
    assert volume.file.spacing_unit == "um"


# --- MetaImage ----------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".mha", ".mhd"])
@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("dtype", ALL_TYPES)
def test_metaimage(tmp_path, dtype, compressed, suffix):
    path = write_itk(tmp_path / f"a{suffix}", voxels(dtype), compressed=compressed)
    volume = read_volume(path)
    assert_volume(volume, voxels(dtype))
    assert volume.notes == ()


@pytest.mark.parametrize("key", ["BinaryDataByteOrderMSB", "ElementByteOrderMSB"])
@pytest.mark.parametrize("compressed", [False, True])
def test_big_endian_metaimage(tmp_path, key, compressed):
    array = voxels()
    data = array.astype(">u2").tobytes()
    path = write_metaimage(
        tmp_path / "a.mha",
        array,
        "BinaryData = True",
        f"{key} = True",
        f"CompressedData = {compressed}",
        "ElementSize = 0.5 2 3",
        "Offset = 10 -20 30",
        data=zlib.compress(data) if compressed else data,
    )
    assert_volume(read_volume(path), array)


@pytest.mark.parametrize("skip", [-1, 40])
def test_metaimage_header_size(tmp_path, skip):
    array = voxels()
    (tmp_path / "a.bin").write_bytes(b"?" * 40 + array.tobytes())
    path = tmp_path / "a.mhd"
    write_metaimage(path, array, f"HeaderSize = {skip}", data=b"", file="a.bin")
    np.testing.assert_array_equal(read_volume(path).scalars, array)


@pytest.mark.parametrize("suffix", [".nrrd", ".mha"])
def test_oblique_grids_are_shown_along_their_own_axes(tmp_path, suffix):
    c, s = np.cos(0.3), np.sin(0.3)
    path = write_itk(
        tmp_path / f"a{suffix}", voxels(), direction=[[c, -s, 0], [s, c, 0], [0, 0, 1]]
    )
    volume = read_volume(path)
    assert_volume(volume, voxels())
    assert ["oblique" in note for note in volume.notes] == [True]


# --- NIfTI --------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("dtype", ALL_TYPES)
def test_nifti(tmp_path, dtype, suffix):
    volume = read_volume(write_itk(tmp_path / f"a{suffix}", voxels(dtype)))
    # NIfTI counts x and y the other way round (RAS against SimpleITK's LPS).
    assert_volume(volume, voxels(dtype), origin=(-10.0, 20.0, 30.0))
    assert volume.name == "a"
    assert volume.notes == ()


def nifti_with(path, changes, array=None):
    """Change numbers of the header, given as {byte: (dtype, value)}."""
    write_itk(path, voxels() if array is None else array)
    data = bytearray(path.read_bytes())
    for offset, (dtype, value) in changes.items():
        packed = np.array(value, dtype).tobytes()
        data[offset : offset + len(packed)] = packed
    path.write_bytes(data)
    return path


@pytest.mark.parametrize(("dtype", "expected"), [("uint16", "float32"), ("int32", "float64")])
def test_nifti_scaling_is_applied(tmp_path, dtype, expected):
    path = nifti_with(tmp_path / "a.nii", {112: ("<f4", [2.5, -7.0])}, voxels(dtype))
    volume = read_volume(path)
    assert volume.scalars.dtype == expected
    itk = sitk.GetArrayFromImage(sitk.ReadImage(str(path), sitk.sitkFloat64))
    np.testing.assert_allclose(volume.scalars, itk, rtol=1e-6)


def test_nifti_big_endian(tmp_path):
    from_itk = bytearray(write_itk(tmp_path / "a.nii", voxels()).read_bytes())
    header = np.frombuffer(bytes(from_itk[:352]), np.uint8).copy()
    fields = [(0, 4, 1), (32, 4, 1), (36, 2, 1), (40, 2, 8), (56, 4, 3), (68, 2, 4), (76, 4, 8)]
    fields += [(108, 4, 3), (120, 2, 1), (124, 4, 6), (252, 2, 2), (256, 4, 18)]
    for start, width, count in fields:
        numbers = header[start : start + width * count].reshape(count, width)
        numbers[:] = numbers[:, ::-1].copy()
    path = tmp_path / "b.nii"
    path.write_bytes(header.tobytes() + voxels().astype(">u2").tobytes())
    assert_volume(read_volume(path), voxels(), origin=(-10.0, 20.0, 30.0))


def test_left_handed_nifti_has_its_slices_reversed_and_says_so(tmp_path):
    volume = read_volume(nifti_with(tmp_path / "a.nii", {76: ("<f4", -1.0), 254: ("<i2", 0)}))
    np.testing.assert_array_equal(volume.scalars, voxels()[::-1])
    assert any("reverse" in note for note in volume.notes)


def test_nifti_without_spacing(tmp_path):
    changes = {80: ("<f4", [-0.5, 0.0, np.nan]), 252: ("<i2", [0, 0])}
    volume = read_volume(nifti_with(tmp_path / "a.nii", changes))
    assert volume.spacing == (0.5, 1.0, 1.0)


# --- VTK's own formats --------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ALL_TYPES)
def test_vti_types(tmp_path, dtype):
    volume = read_volume(write_vti(tmp_path / "a.vti", voxels(dtype)))
    assert_volume(volume, voxels(dtype))
    assert volume.notes == ()


@pytest.mark.parametrize("mode", ["Appended", "Binary", "Ascii"])
@pytest.mark.parametrize("compressor", ["None", "ZLib", "LZ4", "LZMA"])
@pytest.mark.parametrize("encode", [False, True])
def test_vti_encodings(tmp_path, mode, compressor, encode):
    path = write_vti(tmp_path / "a.vti", voxels(), mode, compressor, encode)
    assert_volume(read_volume(path), voxels())


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("dtype", ALL_TYPES)
def test_legacy_vtk(tmp_path, dtype, binary):
    array = voxels(dtype)
    if not binary and dtype.startswith("float"):
        array = np.round(array, 2)
    volume = read_volume(write_legacy(tmp_path / "a.vtk", array, binary))
    if binary or not dtype.startswith("float"):
        assert_volume(volume, array)
    else:
        np.testing.assert_allclose(volume.scalars, array, rtol=1e-5)


def test_legacy_vtk_by_hand(tmp_path):
    header = (
        "# vtk DataFile Version 3.0\nby hand\nBINARY\nDATASET STRUCTURED_POINTS\n"
        "DIMENSIONS 7 5 6\nASPECT_RATIO 0.5 2 3\nORIGIN 10 -20 30\nPOINT_DATA 210\n"
        "SCALARS density unsigned_short 1\nLOOKUP_TABLE default\n"
    )
    path = tmp_path / "a.vtk"
    path.write_bytes(header.encode() + voxels().astype(">u2").tobytes())
    assert_volume(read_volume(path), voxels())


# --- TIFF ---------------------------------------------------------------------------------


@pytest.mark.parametrize("compressed", [False, True])
@pytest.mark.parametrize("dtype", ["uint8", "int8", "uint16", "int16", "float32"])
def test_tiff_by_itk(tmp_path, dtype, compressed):
    volume = read_volume(write_itk(tmp_path / "a.tif", voxels(dtype), compressed=compressed))
    # ITK writes the size of pixels, but no distance of slices.
    assert_volume(volume, voxels(dtype), (*SPACING[:2], SPACING[0]), (0, 0, 0))
    (note,) = volume.notes
    assert note.startswith("The file gives no voxel spacing along z; 0.5 is assumed")


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint32", "int32", "float32"])
def test_tiff_by_hand(tmp_path, dtype, order):
    volume = read_volume(write_tiff(tmp_path / "a.tiff", voxels(dtype), order))
    assert_volume(volume, voxels(dtype), (1, 1, 1), (0, 0, 0))


def test_tiff_calibrated_by_imagej(tmp_path):
    description = b"ImageJ=1.54\nimages=6\nslices=6\nspacing=3.0\nunit=um\n\0"
    path = write_tiff(tmp_path / "a.tif", voxels(), description=description, resolution=(2, 0.5))
    assert_volume(read_volume(path), voxels(), origin=(0, 0, 0))


def test_folder_of_tiff_slices_in_numeric_order(tmp_path):
    array = voxels(shape=(12, 5, 7))
    for z, plane in enumerate(array):
        write_tiff(tmp_path / f"slice{z}.tif", [plane])
    (tmp_path / "notes.txt").write_text("not a slice")
    volume = read_volume(tmp_path)
    assert_volume(volume, array, (1, 1, 1), (0, 0, 0))
    assert volume.name == tmp_path.name.replace("_", " ")


# --- DICOM --------------------------------------------------------------------------------


def itk_series(folder):
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder)))
    return reader.Execute()


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "int32", "uint32"])
def test_dicom_folder(tmp_path, dtype):
    names = ["f", "c", "b", "a", "d", "e"]
    folder = write_dicom(tmp_path / "ct", voxels(dtype), names=names, t0028_1054="HU")
    volume = read_volume(folder)
    assert_volume(volume, voxels(dtype))
    assert (volume.name, volume.units, volume.notes) == ("ct", "HU", ())
    itk = itk_series(folder)
    assert itk.GetSpacing() == pytest.approx(volume.spacing)
    assert itk.GetOrigin() == pytest.approx(volume.origin)


@pytest.mark.parametrize(
    ("dtype", "slope", "intercept"),
    [("uint16", "1", "-1024"), ("uint16", "2", "-1000"), ("int16", "0.25", "3.5")],
)
def test_dicom_rescaling_is_simpleitks(tmp_path, dtype, slope, intercept):
    stored = (voxels(dtype) // 8).astype(dtype)
    folder = write_dicom(tmp_path / "ct", stored)
    for path in folder.iterdir():
        data = path.read_bytes()
        for tag, text in ((b"(\0\x53\x10", slope), (b"(\0\x52\x10", intercept)):
            start = data.index(tag)
            length = int.from_bytes(data[start + 4 : start + 8], "little")
            value = text.encode().ljust(len(text) + len(text) % 2)
            size = len(value).to_bytes(4, "little")
            data = data[: start + 4] + size + value + data[start + 8 + length :]
        path.write_bytes(data)
    volume = read_volume(folder)
    np.testing.assert_allclose(
        volume.scalars, sitk.GetArrayFromImage(itk_series(folder)).astype(float), rtol=1e-6
    )
    assert volume.scalar_range[1] == pytest.approx(stored.max() * float(slope) + float(intercept))


def test_one_slice_stands_for_its_series(tmp_path):
    write_dicom(tmp_path, voxels(), series="1.2.3")
    other = voxels("int16", (3, 5, 7))
    write_dicom(tmp_path, other, series="9.9", names=["x.dcm", "y.dcm", "z.dcm"])
    np.testing.assert_array_equal(read_volume(tmp_path / "y.dcm").scalars, other)
    volume = read_volume(tmp_path)
    np.testing.assert_array_equal(volume.scalars, voxels())
    (note,) = volume.notes
    assert note == "Of 2 series 'series' is read (7 x 5 x 6); also there: series (2)."


def test_missing_dicom_slices_are_noticed(tmp_path):
    write_dicom(tmp_path, voxels())
    (tmp_path / "002.dcm").unlink()
    volume = read_volume(tmp_path)
    assert volume.dimensions == (7, 5, 5)
    assert "1 slice between slices 1 and 2 (at 33 and 39 mm)" in volume.notes[0]


# --- raw ----------------------------------------------------------------------------------


@pytest.mark.parametrize("order", ["little", "big"])
@pytest.mark.parametrize("dtype", ALL_TYPES)
def test_raw_with_a_layout(tmp_path, dtype, order):
    path = tmp_path / "a.dat"
    path.write_bytes(voxels(dtype).astype(np.dtype(dtype).newbyteorder(order)).tobytes())
    volume = read_volume(path, raw=RawLayout((7, 5, 6), dtype, order, SPACING))
    assert_volume(volume, voxels(dtype), origin=(0, 0, 0))


@pytest.mark.parametrize(
    ("name", "layout", "readable"),
    [
        ("engine_256x256x110_uint8", RawLayout((256, 256, 110), "uint8"), "engine"),
        ("my_CT-head_7x5x6_int16_be", RawLayout((7, 5, 6), "int16", "big"), "my CT-head"),
        ("7x5x6.float32.little", RawLayout((7, 5, 6), "float32"), "7x5x6.float32.little"),
        ("foot-7X5X6-ushort-bigendian", RawLayout((7, 5, 6), "ushort", "big"), "foot"),
        ("big_fish_2x2x2_7x5x6_float", RawLayout((7, 5, 6), "float"), "big fish"),
        ("engine_256x256_uint8", None, "engine 256x256 uint8"),
        ("engine_256x256x110", None, "engine"),
    ],
)
def test_layout_and_name_from_the_file_name(tmp_path, name, layout, readable):
    assert RawLayout.parse(name) == layout
    path = write_itk(tmp_path / f"{name}.nrrd", voxels())
    assert read_volume(path).name == readable


@pytest.mark.parametrize(
    "layout",
    [
        RawLayout((7, 5, 6), "int16", "big"),
        RawLayout((7, 5, 6), "float32", spacing=(0.1, 1e-7, 2.5)),
    ],
)
def test_a_layout_comes_back_from_its_text(layout):
    assert RawLayout.parse(layout.text) == layout


def test_raw_by_its_name(tmp_path):
    path = tmp_path / "flow_7x5x6_int16_be.raw"
    path.write_bytes(voxels("int16").astype(">i2").tobytes())
    volume = read_volume(path)
    assert_volume(volume, voxels("int16"), (1, 1, 1), (0, 0, 0))
    assert volume.name == "flow"


# --- components, bad voxels, description ---------------------------------------------------

VECTORS = voxels("float32", (6, 5, 7, 3))


def vector_nrrd(path, first):
    array = VECTORS if first else np.ascontiguousarray(np.moveaxis(VECTORS, -1, 0))
    kinds = "vector domain domain domain" if first else "domain domain domain list"
    return write_nrrd(path, array, f"kinds: {kinds}", "encoding: raw", kind="float")


VECTOR_FILES = {
    "first.nrrd": lambda path: vector_nrrd(path, True),
    "last.nrrd": lambda path: vector_nrrd(path, False),
    "itk.nrrd": lambda path: write_itk(path, VECTORS, vector=True),
    "itk.mha": lambda path: write_itk(path, VECTORS, vector=True),
    "itk.nii": lambda path: write_itk(path, VECTORS, vector=True),
    "vtk.vti": lambda path: write_vti(path, VECTORS, components=3),
    "vtk.vtk": lambda path: write_legacy(path, VECTORS, components=3),
}


@pytest.mark.parametrize("component", [None, 0, 2, "magnitude"])
@pytest.mark.parametrize("file", VECTOR_FILES)
def test_one_component_of_several(tmp_path, file, component):
    path = VECTOR_FILES[file](tmp_path / file)
    volume = read_volume(path, component=component)
    assert volume.dimensions == (7, 5, 6)
    assert volume.scalars.flags.c_contiguous
    magnitude = np.linalg.norm(VECTORS, axis=-1)
    expected = magnitude if component in (None, "magnitude") else VECTORS[..., component]
    np.testing.assert_allclose(volume.scalars, expected, rtol=1e-6)
    listed = [content for content in volume.file.contents if content.kind == "component"]
    assert [content.name for content in listed] == ["0", "1", "2", "magnitude"]
    assert [c.name for c in listed if c.is_read] == [
        str(component or 0) if component == 0 else str(component or "magnitude")
    ]
    assert any("3 components" in note for note in volume.notes) == (component is None)


@pytest.mark.parametrize("component", [None, 0])
def test_component_zero_of_a_scalar_volume_is_the_volume(tmp_path, component):
    path = write_itk(tmp_path / "a.mha", voxels())
    np.testing.assert_array_equal(read_volume(path, component=component).scalars, voxels())


def test_description(tmp_path):
    array = voxels("float32")
    array[0, 0, 0] = np.nan
    path = write_nrrd(
        tmp_path / "jet_7x5x6_float32.nrrd", array, "encoding: raw", "sample units: K", kind="float"
    )
    rows = describe(read_volume(path))
    facts = dict(rows)
    assert facts["name"] == "jet"
    assert facts["dimensions"] == "7 x 5 x 6 voxels"
    assert facts["type"] == "float32"
    assert facts["units"] == "K"
    assert facts["size in memory"] == "840 bytes"
    low, high = (float(word) for word in facts["scalar range"].split(" to "))
    assert (low, high) == pytest.approx((np.nanmin(array), np.nanmax(array)), rel=1e-4)
    assert [label for label, _ in rows].count("note") == 2


def test_suffixes_are_those_that_can_be_read():
    assert {".nrrd", ".nii.gz", ".dcm", ".raw", ".vti", ".tif"} < set(SUFFIXES)
    assert len(INTEGER_TYPES) == 8


def test_a_sheared_grid_says_that_its_shape_is_wrong(tmp_path):
    directions = "space directions: (1,0,0) (0.5,1,0) (0,0,1)"
    path = write_nrrd(
        tmp_path / "a.nrrd",
        voxels(),
        "space dimension: 3",
        directions,
        "endian: little",
        "encoding: raw",
    )
    (note,) = read_volume(path).notes
    assert "not at right angles" in note


def test_a_spacing_that_would_make_a_line_of_the_volume(tmp_path):
    path = write_nrrd(
        tmp_path / "a.nrrd", voxels(), "spacings: 1e-14 1 1", "endian: little", "encoding: raw"
    )
    volume = read_volume(path)
    assert volume.spacing == (1.0, 1.0, 1.0)
    assert "1e-14 x 1 x 1 is unusable" in volume.notes[0]


@pytest.mark.parametrize(
    ("dtype", "low"), [("int64", 2**60), ("int64", -(2**62)), ("uint64", 2**64 - 1000)]
)
@pytest.mark.parametrize("step", [1, 3])
def test_integers_far_from_0_are_told_apart(tmp_path, dtype, low, step):
    """As counters and times in nanoseconds are: floats are 256 apart at 2^60."""
    steps = step * np.arange(4 * 5 * 6).reshape(4, 5, 6)
    voxels = np.array([low + int(s) for s in steps.ravel()], dtype).reshape(steps.shape)
    path = tmp_path / f"a_6x5x4_{dtype}_little.raw"
    path.write_bytes(voxels.astype(f"<{np.dtype(dtype).str[1:]}").tobytes())
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.scalars, steps)
    assert f"less {low}" in volume.notes[-1]
    # Where floats can, nothing is changed.
    path.write_bytes((1000 * steps).astype(f"<{np.dtype(dtype).str[1:]}").tobytes())
    assert read_volume(path).data_range == (0.0, 1000.0 * steps.max())
