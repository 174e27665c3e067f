"""Grids whose slices are shifted against one another, in files that give their axes."""

from __future__ import annotations

import nibabel as nib
import numpy as np
import pytest
from volume_writers import write_nrrd

from model.volume_files import read_volume

STEPS = np.array([[0.5, 0, 0], [0, 2.0, 0], [0.3, -1.0, 3.0]])
ORIGIN = np.array([10.0, -20.0, 30.0])


def field(place):
    """Values at places, shape (..., 3), that linear interpolation reproduces."""
    return 1000 + place @ [3.0, 7.0, 11.0]


def places(shape, steps, origin):
    z, y, x = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
    return np.stack([x, y, z], axis=-1) @ steps + origin


ARRAY = field(places((6, 12, 16), STEPS, ORIGIN)).astype(np.float32)


def write(path):
    if path.suffix == ".nii":
        affine = np.eye(4)
        affine[:3, :3], affine[:3, 3] = STEPS.T, ORIGIN
        image = nib.Nifti1Image(np.ascontiguousarray(ARRAY.T), None)
        image.set_sform(affine, 1)
        nib.save(image, path)
        return path
    directions = " ".join(f"({x},{y},{z})" for x, y, z in STEPS)
    return write_nrrd(
        path,
        ARRAY,
        "space: RAS",
        f"space directions: {directions}",
        f"space origin: ({ORIGIN[0]},{ORIGIN[1]},{ORIGIN[2]})",
        "endian: little",
        "encoding: raw",
        kind="float",
    )


@pytest.mark.parametrize("name", ["a.nii", "a.nrrd"])
def test_slices_are_where_they_were_taken(tmp_path, name):
    volume = read_volume(write(tmp_path / name))
    assert volume.spacing == pytest.approx((0.5, 2.0, 3.0))
    assert volume.missing is not None
    there = ~volume.missing
    # Interpolation needs both neighbors: each slice loses a row and a column at most.
    assert there.sum() >= 6 * 11 * 15
    at = places(volume.voxels.shape, np.diag(volume.spacing), np.array(volume.origin))
    np.testing.assert_allclose(volume.voxels[there], field(at)[there], rtol=1e-5)
    assert any("sheared back" in note for note in volume.notes)
    assert not any("right angles" in note for note in volume.notes)
