"""Masks in files, as SimpleITK reads and writes them, which knows where grids lie."""

from dataclasses import replace

import numpy as np
import pytest
import SimpleITK

from model.errors import TfscopeError
from model.scene.mask import Mask
from model.scene.volume import FileFacts, Label, Volume
from model.volume_files.masks import LabelMap, read_labels, read_mask, write_mask

TURNED = ((0.8, 0.6, 0.0), (-0.6, 0.8, 0.0), (0.0, 0.0, 1.0))
SOME = np.random.default_rng(3).random((4, 5, 6)) < 0.4


def volume(space="", shape=(4, 5, 6), stretch=1.0):
    voxels = np.arange(np.prod(shape), dtype=np.uint16).reshape(shape)
    facts = FileFacts(space=space, directions=TURNED if space else (), spacing_unit="mm")
    spacing, origin = (0.5, 1.5, 2.0 * stretch), (10.0, -20.0, 30.0 * stretch)
    return Volume(voxels, spacing, origin, "scan", file=replace(facts, stretch=stretch))


@pytest.mark.parametrize("suffix", [".nrrd", ".nii", ".nii.gz"])
@pytest.mark.parametrize(
    ("space", "stretch"), [("", 1.0), ("LPS", 1.0), ("RAS", 1.0), ("LPS", 4.0)]
)
def test_a_mask_comes_back_and_lies_where_its_volume_lies(tmp_path, space, stretch, suffix):
    path, mask, scan = tmp_path / f"mask{suffix}", Mask.of(SOME), volume(space, stretch=stretch)
    write_mask(path, mask, scan)
    read = read_labels(path, scan)
    assert read.mask(read.values) == mask and not read.note
    # What is kept stays although another spacing is typed.
    assert read_mask(path, replace(scan, spacing=(1.0, 1.0, 9.0))) == mask
    edged = mask.with_edge(np.packbits(np.indices(SOME.shape)[2] == 2))
    write_mask(tmp_path / f"edged{suffix}", edged, scan)
    assert edged.edge and read_mask(tmp_path / f"edged{suffix}", scan) == edged != mask
    found = SimpleITK.ReadImage(str(path))
    np.testing.assert_array_equal(SimpleITK.GetArrayFromImage(found), SOME)
    np.testing.assert_allclose(found.GetSpacing(), (0.5, 1.5, 2.0), rtol=1e-6)
    if suffix != ".nrrd" and not space:
        # NIfTI has no place in a space without a name.
        return
    # SimpleITK's space is LPS.
    signs = np.array([-1, -1, 1]) if space == "RAS" else np.ones(3)
    np.testing.assert_allclose(found.GetOrigin(), signs * (10.0, -20.0, 30.0), rtol=1e-6)
    expected = signs[:, None] * np.array(TURNED if space else np.eye(3)).T
    np.testing.assert_allclose(np.reshape(found.GetDirection(), (3, 3)), expected, atol=1e-6)


@pytest.mark.parametrize(("name", "none"), [("a.nrrd", 0), ("a.nii.gz", 0), ("a.nrrd", np.nan)])
def test_a_mask_is_labels_of_which_some_are_shown(tmp_path, name, none):
    labels = np.random.default_rng(5).integers(0, 4, (4, 5, 6)).astype(np.int16)
    labels = np.where(labels > 0, labels, none)
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(labels), str(tmp_path / name))
    found = read_labels(tmp_path / name, volume())
    assert found.values == (1, 2, 3) and not found.note
    np.testing.assert_array_equal(read_mask(tmp_path / name, volume()).shown, labels > 0)
    some = found.mask([1, 3])
    np.testing.assert_array_equal(some.shown, labels % 2 == 1)
    assert set(found.shown_by(some)) == {1, 3} and found.shown_by(None) == found.values
    with pytest.raises(TfscopeError, match="Nothing would be left"):
        found.mask([])


def test_labels_that_are_all_alike_show_all_or_nothing(tmp_path):
    every = {"ones.nrrd": 0 * SOME + 1, "none.nii": 0 * SOME, "nan.nrrd": np.where(SOME, 1, np.nan)}
    for name, voxels in every.items():
        SimpleITK.WriteImage(SimpleITK.GetImageFromArray(voxels), str(tmp_path / name))
    assert read_mask(tmp_path / "nan.nrrd", volume()) == Mask.of(SOME)
    assert read_mask(tmp_path / "ones.nrrd", volume()) is None
    with pytest.raises(TfscopeError, match="Nothing would be left"):
        read_mask(tmp_path / "none.nii", volume())


def test_labels_are_named_as_the_file_names_them():
    # A reader that numbers labels anew has the file's numbers in their names.
    named = Label(1, "Liver"), Label(2, "526157192 Lobe, left", None, 526157192)
    labels = LabelMap("organs", SOME, (1.0, 2.0, 3.0, 526157193.0), named)
    assert labels.named_by("liver, 526157192") == [1, 2] and labels.named_by("3,1") == [3, 1]
    assert labels.named_by("3,Lobe, Left,526157193") == [3, 2, 526157193]
    text = "no label 'spleen'; it has 1 Liver, 526157192 Lobe, left, 3, 526157193"
    with pytest.raises(TfscopeError, match=text):
        labels.named_by("liver,spleen")


@pytest.mark.parametrize("turn", [(0, 1, 2), (2, 0, 1)])
def test_labels_of_another_grid_are_resampled_where_they_lie(tmp_path, turn):
    scan = volume("LPS", (12, 14, 16))
    image = SimpleITK.GetImageFromArray(scan.voxels)
    image.SetSpacing(scan.spacing)
    image.SetOrigin(scan.origin)
    image.SetDirection(np.array(TURNED).T.ravel().tolist())
    # Coarser, cut, and its axes in another order.
    coarse = np.random.default_rng(7).integers(0, 4, (7, 6, 9)).astype(np.uint8)
    labels = SimpleITK.GetImageFromArray(coarse)
    labels.SetSpacing((1.0, 2.1, 2.9))
    labels.SetOrigin((11.0, -18.5, 33.0))
    labels.SetDirection(np.array(TURNED).T[:, turn].ravel().tolist())
    how = SimpleITK.Transform(), SimpleITK.sitkNearestNeighbor
    expected = SimpleITK.Resample(labels, image, *how)
    for name in ("labels.nrrd", "labels.nii.gz"):
        SimpleITK.WriteImage(labels, str(tmp_path / name))
        found = read_labels(tmp_path / name, scan)
        assert "each voxel takes the nearest label" in found.note
        np.testing.assert_array_equal(found.voxels, SimpleITK.GetArrayFromImage(expected))
        # A space without a name is that of ITK.
        same = read_labels(tmp_path / name, replace(scan, file=replace(scan.file, space="")))
        assert same.note.endswith("label. scan names no space: LPS is assumed.")
        np.testing.assert_array_equal(same.voxels, found.voxels)
    # Where no label lies, none is shown, unless the grids have one size.
    labels.SetOrigin((1e3, 0.0, 0.0))
    SimpleITK.WriteImage(labels, str(tmp_path / "far.nrrd"))
    with pytest.raises(TfscopeError, match="far has no label where scan lies"):
        read_labels(tmp_path / "far.nrrd", scan)
    same = read_labels(tmp_path / "far.nrrd", volume("RAS", coarse.shape))
    assert "as many voxels" in same.note and same.voxels.any()


def test_what_is_no_mask_is_said(tmp_path):
    write_mask(tmp_path / "mask.nrrd", Mask.of(SOME), volume())
    with pytest.raises(TfscopeError, match="mask has 6 x 5 x 4 voxels and scan 6 x 5 x 5, and the"):
        read_mask(tmp_path / "mask.nrrd", volume(shape=(5, 5, 6)))
    with pytest.raises(TfscopeError, match="no such file"):
        read_mask(tmp_path / "gone.nrrd", volume())
    scan = np.arange(20**3, dtype=np.float32).reshape(20, 20, 20)
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(scan), str(tmp_path / "scan.nrrd"))
    with pytest.raises(TfscopeError, match="8,000 different values, too many for labels"):
        read_labels(tmp_path / "scan.nrrd", volume(shape=(20, 20, 20)))
    with pytest.raises(TfscopeError, match="the mask cannot be written"):
        write_mask(tmp_path / "mask.nrrd" / "below.nrrd", Mask.of(SOME), volume())
