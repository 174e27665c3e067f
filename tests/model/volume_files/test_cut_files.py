import contextlib

import numpy as np
import pytest
import tifffile
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from volume_writers import (
    check,
    refused,
    voxels,
    write_dicom,
    write_itk,
    write_legacy,
    write_metaimage,
    write_nrrd,
    write_tiff,
    write_vti,
)

from model.errors import VolumeError
from model.volume_files import read_volume

ARRAY = voxels()
FLAT = voxels(shape=(5, 7))

# --- truncation ---------------------------------------------------------------------------

TRUNCATED = {
    "raw.nrrd": write_itk,
    "gzip.nrrd": lambda path, array: write_itk(path, array, compressed=True),
    "raw.mha": write_itk,
    "zlib.mha": lambda path, array: write_itk(path, array, compressed=True),
    "raw.nii": write_itk,
    "gzip.nii.gz": write_itk,
    "appended.vti": write_vti,
    "zlib.vti": lambda path, array: write_vti(path, array, compressor="ZLib"),
    "base64.vti": lambda path, array: write_vti(path, array, mode="Binary"),
    # ASCII legacy files are left out: "358" cut to "35" is still a number.
    "binary.vtk": write_legacy,
    "pages.tif": write_tiff,
    "itk.tif": write_itk,
    "a_7x5x6_uint16.raw": lambda path, array: path.write_bytes(array.tobytes()) and path,
}


@pytest.fixture(scope="module")
def whole_files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    return {name: write(folder / name, ARRAY).read_bytes() for name, write in TRUNCATED.items()}


@pytest.mark.parametrize("name", TRUNCATED)
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0, 1, exclude_max=True))
@example(share=0.999999)
@example(share=0.98)
def test_a_file_cut_anywhere_is_refused_or_reads_equal(tmp_path, whole_files, name, share):
    whole = whole_files[name]
    path = tmp_path / name
    path.write_bytes(whole[: int(share * len(whole))])
    with contextlib.suppress(VolumeError):
        check(read_volume(path), ARRAY)


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(share=st.floats(0, 1, exclude_max=True))
@example(share=0.999)
def test_a_dicom_slice_cut_anywhere_is_refused(tmp_path, share):
    folder = tmp_path / "ct"
    if not folder.exists():
        write_dicom(folder, ARRAY)
    path = folder / "005.dcm"
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    try:
        refused(folder, r"005\.dcm")
    finally:
        path.write_bytes(whole)


def test_pixels_that_cannot_be_unpacked(tmp_path):
    array = np.arange(256 * 64, dtype=np.uint16).reshape(4, 64, 64)
    path = tmp_path / "a.tif"
    tifffile.imwrite(path, array, compression="zlib", photometric="minisblack")
    content = bytearray(path.read_bytes())
    content[40:80] = b"\xff" * 40
    path.write_bytes(content)
    refused(path, r"unpacked|damaged")


def write_header(folder, kind, name):
    path, fields = folder / f"a.{kind}", [f"data file: {name}"]
    if kind == "nhdr":
        return write_nrrd(path, ARRAY, *fields, data=b"")
    return write_metaimage(path, ARRAY, data=b"", file=name)


@pytest.mark.parametrize(
    "name", ["../secret.raw", "{tmp}/secret.raw", "sub/../../secret.raw", "link"]
)
@pytest.mark.parametrize("kind", ["nhdr", "mhd"])
def test_no_header_leads_out_of_its_folder(tmp_path, kind, name):
    folder = tmp_path / "data"
    (folder / "sub").mkdir(parents=True)
    for path in (tmp_path / "secret.raw", folder / "sub" / "inside.raw"):
        path.write_bytes(ARRAY.tobytes())
    (folder / "link").symlink_to(tmp_path / "secret.raw")
    path = write_header(folder, kind, name.format(tmp=tmp_path))
    refused(path, "outside the header's folder")
    check(read_volume(write_header(folder, kind, "sub/inside.raw")), ARRAY)


@pytest.mark.parametrize("kind", ["dicom", "tiff"])
def test_no_folder_of_slices_leads_elsewhere(tmp_path, kind):
    elsewhere, folder = tmp_path / "elsewhere", tmp_path / "data"
    for place in (folder, elsewhere):
        place.mkdir()
        if kind == "dicom":
            write_dicom(place, voxels())
        for number in range(3 if kind == "tiff" else 0):
            write_tiff(place / f"{number}.tif", [FLAT])
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
