"""Masks in files, beside SimpleITK's reading of them."""

import numpy as np
import pytest
import SimpleITK

from model.errors import TfscopeError
from model.scene.mask import Mask
from model.scene.volume import FileFacts, Volume
from model.volume_files.masks import mask_of, read_labels, read_mask, write_mask

TURNED = ((0.8, 0.6, 0.0), (-0.6, 0.8, 0.0), (0.0, 0.0, 1.0))
SOME = np.random.default_rng(3).random((4, 5, 6)) < 0.4


def volume(space="", shape=(4, 5, 6)):
    voxels = np.arange(np.prod(shape), dtype=np.uint16).reshape(shape)
    facts = FileFacts(space=space, directions=TURNED if space else (), spacing_unit="mm")
    return Volume(voxels, (0.5, 1.5, 2.0), (10.0, -20.0, 30.0), "scan", file=facts)


@pytest.mark.parametrize("space", ["", "LPS", "RAS"])
def test_a_mask_comes_back_and_lies_where_its_volume_lies(tmp_path, space):
    path, mask = tmp_path / "mask.nrrd", Mask.of(SOME)
    write_mask(path, mask, volume(space))
    assert read_mask(path, volume(space)) == mask
    found = SimpleITK.ReadImage(str(path))
    np.testing.assert_array_equal(SimpleITK.GetArrayFromImage(found), SOME)
    np.testing.assert_allclose(found.GetSpacing(), (0.5, 1.5, 2.0), rtol=1e-6)
    # SimpleITK's space is LPS.
    signs = np.array([-1, -1, 1]) if space == "RAS" else np.ones(3)
    np.testing.assert_allclose(found.GetOrigin(), signs * (10.0, -20.0, 30.0), rtol=1e-6)
    expected = signs[:, None] * np.array(TURNED if space else np.eye(3)).T
    np.testing.assert_allclose(np.reshape(found.GetDirection(), (3, 3)), expected, atol=1e-6)


@pytest.mark.parametrize("name", ["labels.nrrd", "labels.nii.gz"])
def test_a_mask_is_labels_of_which_some_are_shown(tmp_path, name):
    labels = np.random.default_rng(5).integers(0, 4, (4, 5, 6)).astype(np.int16)
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(labels), str(tmp_path / name))
    found, values = read_labels(tmp_path / name)
    assert values == [1, 2, 3]
    np.testing.assert_array_equal(read_mask(tmp_path / name, volume()).shown, labels > 0)
    np.testing.assert_array_equal(mask_of(found, [1, 3], volume()).shown, labels % 2 == 1)
    with pytest.raises(TfscopeError, match="Nothing would be left"):
        mask_of(found, [], volume())


def test_what_is_no_mask_is_said(tmp_path):
    write_mask(tmp_path / "mask.nrrd", Mask.of(SOME), volume())
    with pytest.raises(TfscopeError, match="mask has 6 x 5 x 4 voxels and scan 6 x 5 x 5"):
        read_mask(tmp_path / "mask.nrrd", volume(shape=(5, 5, 6)))
    with pytest.raises(TfscopeError, match="no such file"):
        read_mask(tmp_path / "gone.nrrd", volume())
    scan = np.arange(20**3, dtype=np.float32).reshape(20, 20, 20)
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(scan), str(tmp_path / "scan.nrrd"))
    with pytest.raises(TfscopeError, match="8,000 different values, which are no labels"):
        read_labels(tmp_path / "scan.nrrd")
    with pytest.raises(TfscopeError, match="the mask cannot be written"):
        write_mask(tmp_path / "mask.nrrd" / "below.nrrd", Mask.of(SOME), volume())
