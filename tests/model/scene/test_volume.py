import hashlib

import numpy as np
import pytest

from model.errors import VolumeError
from model.scene.volume import Volume


def ramp(dtype="float32", shape=(4, 5, 6)):
    return np.arange(np.prod(shape), dtype=dtype).reshape(shape)


def test_facts_read_off_the_grid():
    volume = Volume(ramp(), spacing=(1.0, 2.0, 3.0), origin=(10.0, 20.0, 30.0))
    assert volume.dimensions == (6, 5, 4)
    assert volume.extent == (5.0, 8.0, 9.0)
    assert volume.center == (12.5, 24.0, 34.5)
    assert volume.radius == pytest.approx(np.sqrt(25 + 64 + 81) / 2)
    assert volume.voxel_size == pytest.approx(6 ** (1 / 3))
    assert volume.scalar_range == (0.0, 119.0)


@pytest.mark.parametrize("dtype", ["int8", "uint16", "int64", "float32", "float64"])
@pytest.mark.parametrize("bins", [1, 7, 256])
def test_histogram_is_numpys(dtype, bins):
    scalars = np.random.default_rng(3).normal(20, 30, (7, 9, 8)).astype(dtype)
    counts, edges = Volume(scalars).histogram(bins)
    expected, expected_edges = np.histogram(scalars.astype(np.float64), bins=bins)
    np.testing.assert_allclose(edges, expected_edges)
    np.testing.assert_array_equal(counts, expected)
    assert counts.sum() == scalars.size


@pytest.mark.parametrize(
    ("scalars", "spacing", "message"),
    [
        (np.zeros((4, 5)), (1, 1, 1), "three axes of at least two voxels"),
        (np.zeros((1, 4, 5)), (1, 1, 1), "three axes of at least two voxels"),
        (ramp("complex64"), (1, 1, 1), "not real numbers"),
        (ramp(), (1, 0, 1), "must be positive"),
        (ramp(), (1, 1, float("nan")), "must be positive"),
        (np.full((2, 2, 2), 7), (1, 1, 1), "every voxel has the value 7"),
        (np.array([[[0, 1], [2, np.nan]]] * 2), (1, 1, 1), "NaN or infinite"),
    ],
)
def test_what_is_no_volume_is_refused(scalars, spacing, message):
    with pytest.raises(VolumeError, match=message):
        Volume(scalars, spacing, name="jet")


def test_fingerprint_tells_voxels_type_and_spacing_apart():
    volume = Volume(ramp())
    same = Volume(ramp().astype(">f4"), name="other name")
    assert volume.fingerprint == same.fingerprint
    different = [
        Volume(ramp("float64")),
        Volume(ramp() + 1),
        Volume(ramp(), (1.0, 1.0, 2.0)),
        Volume(ramp().reshape(5, 4, 6)),
    ]
    prints = {v.fingerprint for v in [volume, *different]}
    assert len(prints) == 5
    assert all(len(p) == len(hashlib.sha256().hexdigest()) for p in prints)
