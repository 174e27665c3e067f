"""NIfTI, Analyze and MGH files, against nibabel and SimpleITK."""

import gzip
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from volume_writers import SPACING, check, patched, refused, voxels, write_itk

from model.volume_files import Choice, read_volume

CASES = Path(__file__).parent / "cases" / "nifti"
AFFINE = np.array([[0.5, 0, 0, 10], [0, 2, 0, -20], [0, 0, 3, 30], [0, 0, 0, 1]], float)
ORIGIN = (10, -20, 30)
ARRAY = voxels("int16")


def save(path, array=ARRAY, affine=AFFINE, kind=nib.Nifti1Image):
    """Write an array, with x first as nibabel has it."""
    nib.save(kind(np.ascontiguousarray(array.T), affine), path)
    return path


@pytest.mark.parametrize(("file", "spacing", "note"), [
    ("pixdim_ones_sform_only.nii", (0.5, 0.5, 3), "voxel sizes 1 x 1 x 1 differ"),
    ("qform_LAS_sform_RAS.nii", (1, 1, 2), "mirror images of one another; the sform is used"),
])  # fmt: skip
def test_the_sform_holds(file, spacing, note):
    image = nib.load(CASES / file)
    place = {"spacing": spacing, "origin": tuple(image.affine[:3, 3])}
    labels = ("R", "L", "A", "P", "S", "I")
    expected = np.asarray(image.dataobj).T
    check(read_volume(CASES / file), expected, note, **place, axis_labels=labels)


@pytest.mark.parametrize(("dtype", "scaled"), [("uint16", "float32"), ("int32", "float64")])
def test_scaling_is_applied(tmp_path, dtype, scaled):
    path = write_itk(tmp_path / "a.nii", voxels(dtype))
    volume = read_volume(patched(path, {112: ("<f4", [2.5, -7.0])}))
    assert volume.voxels.dtype == scaled
    itk = sitk.GetArrayFromImage(sitk.ReadImage(str(path), sitk.sitkFloat64))
    np.testing.assert_allclose(volume.voxels, itk, rtol=1e-6)


def test_spm_factor_of_analyze_is_applied(tmp_path):
    path = save(tmp_path / "a.img", kind=nib.AnalyzeImage)
    patched(tmp_path / "a.hdr", {112: ("<f4", 2.5)})
    volume = read_volume(path)
    np.testing.assert_allclose(volume.voxels, nib.load(path).get_fdata().T)
    assert "factor 2.5" in " ".join(volume.notes)


def test_big_endian(tmp_path):
    image = nib.Nifti1Image(np.ascontiguousarray(ARRAY.T), AFFINE)
    swapped = nib.Nifti1Image(image.dataobj, AFFINE, image.header.as_byteswapped(">"))
    nib.save(swapped, tmp_path / "a.nii")
    assert (tmp_path / "a.nii").read_bytes()[:4] == b"\0\0\x01\x5c"
    check(read_volume(tmp_path / "a.nii"), ARRAY, spacing=SPACING, origin=ORIGIN)


@pytest.mark.parametrize(
    ("changes", "is_reversed", "facts"),
    [
        # A left-handed file of superior slices first is read in reverse, and labelled so.
        ({76: ("<f4", -1.0), 254: ("<i2", 0)}, True, {"axis_labels": tuple("LRPASI")}),
        ({80: ("<f4", [-0.5, 0.0, np.nan]), 252: ("<i2", [0, 0])}, False, {"spacing": (0.5, 1, 1)}),
    ],
)
def test_a_qform_that_mirrors_and_none_at_all(tmp_path, changes, is_reversed, facts):
    volume = read_volume(patched(write_itk(tmp_path / "a.nii", ARRAY), changes))
    said = "reverse" if is_reversed else ""
    check(volume, ARRAY[::-1] if is_reversed else ARRAY, said, **facts)


def test_a_name_of_another_kind_and_a_lost_mark(tmp_path):
    path = save(tmp_path / "a.nii")
    content = path.read_bytes()
    (tmp_path / "a.nrrd").write_bytes(content)
    check(read_volume(tmp_path / "a.nrrd"), ARRAY, "kind '.nii'")
    path.write_bytes(content[:344] + b"xxx" + content[347:])
    check(read_volume(path), ARRAY, "no mark of NIfTI")
    path.write_bytes(content[:70] + b"\x09\0" + content[72:])
    refused(path, "its data type 9 is none of NIfTI-1's")


WRITERS = {
    "a.nii": nib.Nifti1Image, "b.nii.gz": nib.Nifti1Image, "c.nii": nib.Nifti2Image,
    "d.nii.gz": nib.Nifti2Image, "e.img": nib.Nifti1Pair, "f.mgh": nib.MGHImage,
    "g.mgz": nib.MGHImage, "h.img": nib.AnalyzeImage,
}  # fmt: skip


@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32", "int32"])
@pytest.mark.parametrize("name", WRITERS)
def test_formats_of_nibabel(tmp_path, name, dtype):
    path, array = tmp_path / name, voxels(dtype)
    facts = {"origin": ORIGIN, "directions": ((1, 0, 0), (0, 1, 0), (0, 0, 1))}
    facts = {} if name == "h.img" else facts
    volume = read_volume(save(path, array, kind=WRITERS[name]))
    check(volume, array, spacing=SPACING, **facts)
    if name.endswith(".img"):
        check(read_volume(path.with_suffix(".hdr")), array)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
@pytest.mark.parametrize("time", [0, 1, 3])
def test_one_of_several_times(tmp_path, time, suffix):
    array = voxels("int16", (4, 6, 5, 7))
    path = save(tmp_path / f"a{suffix}", array)
    volume = read_volume(path, choice=Choice(time=str(time)))
    check(volume, array[time])
    assert [content.is_read for content in volume.file.contents] == [k == time for k in range(4)]
    refused(path, "no time step '4'", choice=Choice(time="4"))


def test_colours_are_components(tmp_path):
    array = voxels("uint8", (6, 5, 7, 3))
    kind = np.dtype([("R", "u1"), ("G", "u1"), ("B", "u1")])
    path = save(tmp_path / "a.nii", np.ascontiguousarray(array).view(kind)[..., 0])
    for component in range(3):
        check(read_volume(path, choice=Choice(component=str(component))), array[..., component])


FLAT = voxels("int16", (6, 1, 5, 7))


def micron(path):
    image = nib.Nifti1Image(np.ascontiguousarray(ARRAY.T), AFFINE)
    image.header.set_xyzt_units("micron")
    nib.save(image, path)
    return path


def longer(path):
    """A stream with more behind the voxels."""
    content = save(path).read_bytes() + b"more of it"
    (path.parent / "b.nii.gz").write_bytes(gzip.compress(content))
    return path.parent / "b.nii.gz"


ODD = {
    "left-handed": (lambda p: save(p, affine=AFFINE * [[-1], [1], [1], [1]]), ARRAY[::-1],
        "reverse order", {}),
    "times": (lambda p: save(p, FLAT), FLAT[:, 0], "calls its images time steps", {}),
    "no offset": (lambda p: patched(save(p), {108: ("<f4", 0)}), ARRAY, "", {}),
    "micron": (micron, ARRAY, "", {"spacing_unit": "um"}),
    "longer": (longer, ARRAY, "", {}),
}  # fmt: skip


@pytest.mark.parametrize("name", ODD)
def test_odd_files(tmp_path, name):
    write, array, said, facts = ODD[name]
    volume = read_volume(write(tmp_path / "a.nii"))
    check(volume, array, said, **facts)
    assert np.linalg.det(np.array(volume.file.directions)) > 0


def test_a_pair_without_its_half(tmp_path):
    path = save(tmp_path / "a.img", kind=nib.Nifti1Pair)
    (tmp_path / "a.hdr").unlink()
    refused(path, r"needs the file a\.hdr next to it")
