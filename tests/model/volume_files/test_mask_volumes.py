"""Masks in files, beside SimpleITK's reading of them."""

from dataclasses import replace

import numpy as np
import pytest
import SimpleITK

from model.errors import TfscopeError
from model.scene.mask import Mask
from model.scene.volume import FileFacts, Volume
from model.volume_files import read_volume
from model.volume_files.masks import mask_of, read_labels, read_mask, resampled, write_mask

TURNED = ((0.8, 0.6, 0.0), (-0.6, 0.8, 0.0), (0.0, 0.0, 1.0))


def volume(space="", shape=(4, 5, 6), name="scan"):
    voxels = np.arange(np.prod(shape), dtype=np.uint16).reshape(shape)
    facts = FileFacts(space=space, directions=TURNED if space else (), spacing_unit="mm")
    return Volume(voxels, (0.5, 1.5, 2.0), (10.0, -20.0, 30.0), name, file=facts)


def some(shape=(4, 5, 6)):
    return np.random.default_rng(3).random(shape) < 0.4


@pytest.mark.parametrize("suffix", [".nrrd", ".nii", ".nii.gz"])
@pytest.mark.parametrize("space", ["", "LPS", "RAS"])
def test_a_mask_comes_back_and_lies_where_its_volume_lies(tmp_path, suffix, space):
    path, mask = tmp_path / f"mask{suffix}", Mask.of(some())
    write_mask(path, mask, volume(space))
    assert read_mask(path, volume(space)) == mask
    found = SimpleITK.ReadImage(str(path))
    np.testing.assert_array_equal(SimpleITK.GetArrayFromImage(found), some())
    np.testing.assert_allclose(found.GetSpacing(), (0.5, 1.5, 2.0), rtol=1e-6)
    # SimpleITK's space is LPS; without a name, NRRD's is taken for it and NIfTI's is RAS.
    is_ras = space == "RAS" or (not space and suffix != ".nrrd")
    signs = np.array([-1, -1, 1]) if is_ras else np.ones(3)
    np.testing.assert_allclose(found.GetOrigin(), signs * (10.0, -20.0, 30.0), rtol=1e-6)
    axes = np.array(TURNED if space else np.eye(3)).T
    expected = signs[:, None] * axes
    np.testing.assert_allclose(np.reshape(found.GetDirection(), (3, 3)), expected, atol=1e-6)


def test_a_mask_is_labels_of_which_some_are_shown(tmp_path):
    labels = np.random.default_rng(5).integers(0, 4, (4, 5, 6)).astype(np.int16)
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(labels), str(tmp_path / "labels.nrrd"))
    found, values = read_labels(tmp_path / "labels.nrrd")
    assert values == [1, 2, 3]
    np.testing.assert_array_equal(mask_of(found, volume(), values).shown, labels > 0)
    np.testing.assert_array_equal(mask_of(found, volume(), [1, 3]).shown, labels % 2 == 1)
    with pytest.raises(TfscopeError, match="Nothing would be left"):
        mask_of(found, volume(), [])
    assert read_volume(tmp_path / "labels.nrrd").dimensions == (6, 5, 4)


def test_what_is_no_mask_is_said(tmp_path):
    write_mask(tmp_path / "mask.nrrd", Mask.of(some()), volume())
    with pytest.raises(TfscopeError, match="6 x 5 x 4 voxels and other 6 x 5 x 5"):
        read_mask(tmp_path / "mask.nrrd", volume(shape=(5, 5, 6), name="other"))
    with pytest.raises(TfscopeError, match="no such file"):
        read_mask(tmp_path / "gone.nrrd", volume())
    scan = np.arange(20**3, dtype=np.float32).reshape(20, 20, 20)
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(scan), str(tmp_path / "scan.nrrd"))
    with pytest.raises(TfscopeError, match="8,000 different values, which are no labels"):
        read_labels(tmp_path / "scan.nrrd")
    with pytest.raises(TfscopeError, match="the mask cannot be written"):
        write_mask(tmp_path / "mask.nrrd" / "below.nrrd", Mask.of(some()), volume())


def test_labels_of_another_grid_are_resampled_to_the_nearest():
    whole = volume("LPS")
    # Every second voxel along x, from the second on, and two layers only.
    labels = some()[1:3, :, 1::2].astype(np.uint8)
    origin = np.array(whole.origin) + np.array(TURNED).T @ (0.5, 0.0, 2.0)
    coarse = Volume(labels, (1.0, 1.5, 2.0), tuple(origin), "coarse", file=whole.file)
    found = resampled(coarse, whole)
    assert found.dimensions == whole.dimensions and found.spacing == whole.spacing
    np.testing.assert_array_equal(found.voxels[1:3, :, 1::2], labels)
    assert not found.voxels[[0, 3]].any()
    far = replace(coarse, origin=(1e3, 0.0, 0.0))
    for other, said in [
        (far, "no place in common"),
        (replace(coarse, file=FileFacts(spacing_unit="mm")), "resample it where it was made"),
        (replace(coarse, file=replace(whole.file, spacing_unit="m")), "resample it where"),
    ]:
        with pytest.raises(TfscopeError, match=said):
            resampled(other, whole)
