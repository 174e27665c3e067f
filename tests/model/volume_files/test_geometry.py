"""Where voxels lie, in grids of any orientation, against ITK; none is shown mirrored."""

from __future__ import annotations

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from volume_writers import voxels

from model.volume_files import read_volume


def any_grid(rng, array):
    """An image that is turned, mirrored or oblique."""
    if rng.random() < 0.5:
        directions = np.eye(3)[rng.permutation(3)]
    else:
        directions, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    image = sitk.GetImageFromArray(array)
    image.SetSpacing(tuple(rng.uniform(0.3, 3, 3)))
    image.SetOrigin(tuple(rng.uniform(-50, 50, 3)))
    image.SetDirection(tuple((directions * rng.choice([-1, 1], 3)).ravel()))
    return image


@pytest.mark.parametrize("suffix", [".nrrd", ".mha", ".nii", ".nii.gz"])
def test_every_voxel_lies_where_itk_has_it(tmp_path, suffix):
    rng = np.random.default_rng(3)
    path = tmp_path / f"a{suffix}"
    for _ in range(12):
        image = any_grid(rng, voxels())
        sitk.WriteImage(image, str(path))
        volume = read_volume(path)
        directions = np.array(volume.file.directions)
        assert np.linalg.det(directions) > 0
        # NIfTI's space is RAS, ITK's LPS.
        signs = (-1, -1, 1) if ".nii" in suffix else (1, 1, 1)
        for index in rng.integers(0, volume.dimensions, (8, 3)):
            place = (np.array(volume.origin) + index * volume.spacing @ directions) * signs
            x, y, z = index
            assert (
                image[image.TransformPhysicalPointToIndex(place.tolist())]
                == (volume.voxels[z, y, x])
            )
