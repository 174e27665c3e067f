"""NIfTI, Analyze and MGH files, against nibabel."""

from __future__ import annotations

import gzip
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
from volume_writers import voxels

from model.errors import VolumeError
from model.volume_files import Choice, read_volume

CASES = Path(__file__).parent / "cases" / "nifti"
AFFINE = np.array([[0.5, 0, 0, 10], [0, 2, 0, -20], [0, 0, 3, 30], [0, 0, 0, 1]], float)


def said(volume):
    return " ".join(volume.notes)


def fast_first(array):
    """The same voxels with x first, as nibabel has them."""
    return np.ascontiguousarray(array.T)


@pytest.mark.parametrize(
    ("file", "spacing", "note"),
    [
        ("pixdim_ones_sform_only.nii", (0.5, 0.5, 3), "voxel sizes 1 x 1 x 1 differ"),
        ("qform_LAS_sform_RAS.nii", (1, 1, 2), "mirror images of one another; the sform holds"),
    ],
)
def test_the_sform_holds(file, spacing, note):
    volume = read_volume(CASES / file)
    image = nib.load(CASES / file)
    np.testing.assert_array_equal(volume.voxels, np.asarray(image.dataobj).T)
    assert volume.spacing == pytest.approx(spacing)
    assert volume.origin == pytest.approx(tuple(image.affine[:3, 3]))
    assert volume.axis_labels == ("R", "L", "A", "P", "S", "I")
    assert note in said(volume)


def test_spm_factor_of_analyze_is_applied(tmp_path):
    nib.save(nib.AnalyzeImage(fast_first(voxels("int16")), AFFINE), tmp_path / "a.img")
    header = bytearray((tmp_path / "a.hdr").read_bytes())
    header[112:116] = np.float32(2.5).tobytes()
    (tmp_path / "a.hdr").write_bytes(header)
    volume = read_volume(tmp_path / "a.img")
    expected = nib.load(tmp_path / "a.img").get_fdata()
    np.testing.assert_allclose(volume.voxels, expected.T)
    assert "factor 2.5" in said(volume)


def test_a_name_of_another_kind_and_a_lost_mark(tmp_path):
    nib.save(nib.Nifti1Image(fast_first(voxels("int16")), AFFINE), tmp_path / "a.nii")
    content = (tmp_path / "a.nii").read_bytes()
    (tmp_path / "a.nrrd").write_bytes(content)
    volume = read_volume(tmp_path / "a.nrrd")
    np.testing.assert_array_equal(volume.voxels, voxels("int16"))
    assert "kind '.nii'" in said(volume)
    (tmp_path / "a.nii").write_bytes(content[:344] + b"xxx" + content[347:])
    assert "lacks the mark" in said(read_volume(tmp_path / "a.nii"))
    (tmp_path / "a.nii").write_bytes(content[:70] + b"\x09\0" + content[72:])
    with pytest.raises(VolumeError, match="its data type 9 is none of NIfTI-1's"):
        read_volume(tmp_path / "a.nii")


WRITERS = {
    "a.nii": nib.Nifti1Image,
    "b.nii.gz": nib.Nifti1Image,
    "c.nii": nib.Nifti2Image,
    "d.nii.gz": nib.Nifti2Image,
    "e.img": nib.Nifti1Pair,
    "f.mgh": nib.MGHImage,
    "g.mgz": nib.MGHImage,
    "h.img": nib.AnalyzeImage,
}


@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32", "int32"])
@pytest.mark.parametrize("name", WRITERS)
def test_formats_of_nibabel(tmp_path, name, dtype):
    array = voxels(dtype)
    image = WRITERS[name](fast_first(array), AFFINE)
    nib.save(image, tmp_path / name)
    volume = read_volume(tmp_path / name)
    np.testing.assert_array_equal(volume.voxels, array)
    assert volume.spacing == pytest.approx((0.5, 2, 3))
    if name != "h.img":
        assert volume.origin == pytest.approx((10, -20, 30))
        assert volume.file.directions == ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    if name.endswith(".img"):
        header = (tmp_path / name).with_suffix(".hdr")
        np.testing.assert_array_equal(read_volume(header).voxels, array)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("time", [0, 1, 3])
def test_one_of_several_times(tmp_path, time, suffix):
    array = voxels("int16", (4, 6, 5, 7))
    path = tmp_path / f"a{suffix}"
    nib.save(nib.Nifti1Image(fast_first(array), AFFINE), path)
    volume = read_volume(path, choice=Choice(time=str(time)))
    np.testing.assert_array_equal(volume.voxels, array[time])
    assert [content.is_read for content in volume.file.contents] == [k == time for k in range(4)]
    with pytest.raises(VolumeError, match="no time step '4'"):
        read_volume(path, choice=Choice(time="4"))


def test_colours_are_components(tmp_path):
    array = voxels("uint8", (6, 5, 7, 3))
    kind = np.dtype([("R", "u1"), ("G", "u1"), ("B", "u1")])
    colors = np.ascontiguousarray(array).view(kind)[..., 0]
    nib.save(nib.Nifti1Image(fast_first(colors), AFFINE), tmp_path / "a.nii")
    for component in range(3):
        volume = read_volume(tmp_path / "a.nii", component=component)
        np.testing.assert_array_equal(volume.voxels, array[..., component])


def test_units_of_length(tmp_path):
    image = nib.Nifti1Image(fast_first(voxels("int16")), AFFINE)
    image.header.set_xyzt_units("micron")
    nib.save(image, tmp_path / "a.nii")
    assert read_volume(tmp_path / "a.nii").file.spacing_unit == "um"


@pytest.mark.parametrize("turn", ["mirrored", "turned", "placed"])
def test_a_qform_that_disagrees(tmp_path, turn):
    other = AFFINE.copy()
    if turn == "mirrored":
        other[0, 0] = -0.5
    elif turn == "turned":
        other[:3, :3] = AFFINE[:3, :3][[1, 2, 0]]
    else:
        other[2, 3] = 90
    image = nib.Nifti1Image(fast_first(voxels("int16")), AFFINE)
    image.set_sform(AFFINE, 2)
    image.set_qform(other, 1)
    nib.save(image, tmp_path / "a.nii")
    volume = read_volume(tmp_path / "a.nii")
    words = {"mirrored": "mirror images", "turned": "turn the grid", "placed": "place the grid"}
    assert words[turn] in said(volume)
    assert volume.origin == pytest.approx((10, -20, 30))


def test_a_left_handed_sform_is_not_shown_mirrored(tmp_path):
    array = voxels("int16")
    image = nib.Nifti1Image(fast_first(array), AFFINE * [[-1], [1], [1], [1]])
    nib.save(image, tmp_path / "a.nii")
    volume = read_volume(tmp_path / "a.nii")
    np.testing.assert_array_equal(volume.voxels, array[::-1])
    assert np.linalg.det(np.array(volume.file.directions)) > 0
    assert "reverse order" in said(volume)


def test_slices_that_are_called_times(tmp_path):
    array = voxels("int16", (6, 1, 5, 7))
    nib.save(nib.Nifti1Image(fast_first(array), AFFINE), tmp_path / "a.nii")
    volume = read_volume(tmp_path / "a.nii")
    np.testing.assert_array_equal(volume.voxels, array[:, 0])
    assert "calls its images time steps" in said(volume)


def test_an_offset_that_is_left_out(tmp_path):
    path, array = tmp_path / "a.nii", voxels("int16")
    nib.save(nib.Nifti1Image(fast_first(array), AFFINE), path)
    content = bytearray(path.read_bytes())
    content[108:112] = np.float32(0).tobytes()
    path.write_bytes(content)
    np.testing.assert_array_equal(read_volume(path).voxels, array)


def test_a_pair_without_its_half(tmp_path):
    nib.save(nib.Nifti1Pair(fast_first(voxels("int16")), AFFINE), tmp_path / "a.img")
    (tmp_path / "a.hdr").unlink()
    with pytest.raises(VolumeError, match=r"needs the file a\.hdr beside it"):
        read_volume(tmp_path / "a.img")


def test_a_stream_that_is_cut_or_longer(tmp_path):
    path = tmp_path / "a.nii.gz"
    nib.save(nib.Nifti1Image(fast_first(voxels("int16")), AFFINE), path)
    whole = gzip.decompress(path.read_bytes())
    path.write_bytes(gzip.compress(whole + b"more of it"))
    np.testing.assert_array_equal(read_volume(path).voxels, voxels("int16"))
    path.write_bytes(gzip.compress(whole)[:-9])
    with pytest.raises(VolumeError, match="truncated"):
        read_volume(path)
