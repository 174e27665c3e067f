"""Robust ranges: outliers, tails and fill values are left out, structure never."""

import numpy as np
import pytest

from model.errors import VolumeError
from model.scene.robust_range import percentile_range, robust_range
from model.scene.volume import Volume

SHAPE = (24, 24, 24)
RNG = np.random.default_rng(5)
BULK = RNG.uniform(2.0, 7.0, SHAPE)
ENDS = BULK.min(), BULK.max()


def changed(places, value, dtype="float64"):
    voxels = BULK.copy()
    voxels[places] = value
    return Volume(voxels.astype(dtype))


@pytest.mark.parametrize("outlier", [60.0, -60.0, 1e30, -1e30, 1e308])
@pytest.mark.parametrize("count", [1, 5])
def test_outliers_are_left_out(outlier, count):
    volume = changed((0, 0, slice(count)), outlier)
    rest = volume.voxels[volume.voxels != outlier]
    assert robust_range(volume) == (rest.min(), rest.max())
    # Whatever range the volume has now.
    assert robust_range(volume.over((3.0, 4.0))) == (rest.min(), rest.max())


@pytest.mark.parametrize("value", [-1.0, 8.0, 20.0])
def test_values_that_leave_room_for_the_rest_are_kept(value):
    volume = changed((0, 0, 0), value)
    assert robust_range(volume) == volume.data_range


def test_a_long_thin_tail_is_cut_where_it_is_thin():
    volume = Volume(RNG.lognormal(0.0, 3.0, SHAPE))
    lo, hi = robust_range(volume)
    assert lo == volume.data_range[0]
    beyond = (volume.voxels > hi).mean()
    assert 0 < beyond < 0.001
    # Much of the range is in use.
    assert np.quantile(volume.voxels, 0.999) > hi / 3


@pytest.mark.parametrize("fill", [-9999.0, 1e20])
def test_a_fill_value_remains_something_else(fill):
    lo, hi = robust_range(changed(slice(8), fill))
    rest = BULK[8:]
    if fill < 0:
        assert rest.min() - 1.0 < lo < rest.min() - 0.5 and hi == rest.max()
    else:
        assert rest.max() + 1.0 > hi > rest.max() + 0.5 and lo == rest.min()


def test_structure_in_a_few_voxels_is_kept():
    voxels = np.zeros(SHAPE, np.int16)
    voxels[5:8, 5, 5] = 300, 500, 400
    voxels[9, 9, 9:12] = 450, 480, 320
    assert robust_range(Volume(voxels)) == (0.0, 500.0)
    voxels[0, 0, 0] = 32000
    assert robust_range(Volume(voxels)) == (0.0, 500.0)


@pytest.mark.parametrize("high", [1, 255])
def test_a_mask_keeps_both_values(high):
    voxels = ((BULK > 6.9) * high).astype(np.int32)
    assert robust_range(Volume(voxels)) == (0.0, high)
    voxels[0, 0, 0] = 10**9
    assert robust_range(Volume(voxels)) == (0.0, high)


@pytest.mark.parametrize("dtype", ["uint8", "float32"])
def test_percentiles_are_numpys(dtype):
    voxels = (30 * BULK).astype(dtype)
    lo, hi = percentile_range(Volume(voxels), 2, 97.5)
    expected = np.percentile(voxels, [2, 97.5], method="inverted_cdf")
    assert (lo, hi) == tuple(expected.astype(float))
    assert percentile_range(Volume(voxels), 0, 100) == (voxels.min(), voxels.max())


def test_percentiles_of_many_voxels_are_those_of_a_sample():
    voxels = RNG.uniform(0, 1, (80, 80, 80)).astype(np.float32)
    assert percentile_range(Volume(voxels), 1, 99) == pytest.approx((0.01, 0.99), abs=2e-3)
    assert percentile_range(Volume(voxels), 0, 100) == (voxels.min(), voxels.max())


@pytest.mark.parametrize(
    ("low", "high", "message"),
    [(5, 5, "no range of percentiles"), (-1, 5, "no range"), (1, 40, "all voxels are 0")],
)
def test_percentiles_without_a_range_are_refused(low, high, message):
    with pytest.raises(VolumeError, match=message):
        percentile_range(changed(slice(12), 0.0), low, high)


def test_missing_voxels_do_not_count():
    """Two fill values, far away, and in more voxels than there are others."""
    voxels = np.random.default_rng(1).integers(0, 200, (20, 20, 20)).astype(np.int16)
    missing = np.random.default_rng(2).random(voxels.shape) < 0.7
    voxels[missing] = np.where(np.arange(missing.sum()) % 2, -9999, 32000)
    volume = Volume(voxels, missing=missing)
    assert robust_range(volume) == (0.0, 199.0)
    assert percentile_range(volume, 0, 100) == (0.0, 199.0)
