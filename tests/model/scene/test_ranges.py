"""Scalar ranges, linear and logarithmic, against NumPy."""

import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.errors import TfscopeError, VolumeError
from model.scene.default_tf import default_transfer_function
from model.scene.ranges import (
    RangeChoice,
    fit_to_range,
    fit_to_volume,
    percentile_range,
    robust_range,
    value_text,
)
from model.scene.scene import Scene
from model.scene.tf_presets import color_tf_of_map
from model.scene.transfer_function import (
    TF_SAMPLES,
    ColorTF,
    GaussianMode,
    OpacityTF,
    TransferFunction,
)
from model.scene.value_scale import logarithmic_ticks, suits_logarithm, values_at
from model.scene.volume import Volume

SHAPE = (24, 24, 24)
RNG = np.random.default_rng(5)
BULK = RNG.uniform(2.0, 7.0, SHAPE)


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


@pytest.mark.parametrize(
    ("low", "high", "message"),
    [(5, 5, "not a range of percentiles"), (-1, 5, "not a range"), (1, 40, "all voxels are 0")],
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


STOPS = ((0.0, 0.1, 0.2, 0.3), (50.0, 0.9, 0.5, 0.1), (100.0, 0.3, 0.8, 0.7))
MODES = TransferFunction(
    OpacityTF((0.0, 100.0), (GaussianMode(30.0, 10.0, 0.5), GaussianMode(80.0, 5.0, 0.9))),
    ColorTF((0.0, 100.0), STOPS),
)
CURVE = TransferFunction(
    OpacityTF((0.0, 100.0), points=((0.0, 0.2), (40.0, 1.0), (100.0, 0.0))),
    ColorTF((0.0, 100.0), STOPS),
)


@pytest.mark.parametrize("tf", [MODES, CURVE])
@pytest.mark.parametrize("scalar_range", [(0.0, 100.0), (20.0, 70.0), (-50.0, 300.0), (60.0, 90.0)])
def test_overlapping_ranges_keep_every_value(tf, scalar_range):
    fitted = fit_to_range(tf, scalar_range)
    values = np.linspace(*scalar_range, 301)
    np.testing.assert_allclose(fitted.opacity(values), tf.opacity(values), atol=1e-12)
    np.testing.assert_allclose(fitted.color(values), tf.color(values), atol=1e-12)
    assert fitted.scalar_range == fitted.color.scalar_range == scalar_range
    assert (fitted.color.stops[0][0], fitted.color.stops[-1][0]) == scalar_range


@pytest.mark.parametrize("tf", [MODES, CURVE])
def test_ranges_without_a_common_value_are_stretched(tf):
    fitted = fit_to_range(tf, (1000.0, 1200.0))
    own = np.linspace(0.0, 100.0, 101)
    np.testing.assert_allclose(fitted.opacity(1000 + 2 * own), tf.opacity(own), atol=1e-12)
    np.testing.assert_allclose(fitted.color(1000 + 2 * own), tf.color(own), atol=1e-12)


def over(lo, hi):
    return fit_to_range(replace(RELATIVE, is_relative=True), (lo, hi))


RELATIVE = TransferFunction(
    OpacityTF((0.0, 1.0), (GaussianMode(0.3, 0.1, 0.5),)),
    ColorTF((0.0, 1.0), ((0.0, 0.1, 0.2, 0.3), (1.0, 0.3, 0.8, 0.7))),
    is_relative=True,
)
CT = Volume(np.linspace(-1024, 3071, 4096).reshape(16, 16, 16).astype(np.int16))


@pytest.mark.parametrize("scalar_range", [(0.5, 2.5), (-1024.0, 3071.0), (0.1, 0.1 + 1e-9)])
def test_fractions_become_values(scalar_range):
    fitted = fit_to_range(RELATIVE, scalar_range)
    lo, hi = fitted.scalar_range
    assert (lo, hi) == scalar_range and not fitted.is_relative
    values = np.linspace(0, 1, 11)
    exact = RELATIVE.opacity(values)
    np.testing.assert_allclose(fitted.opacity(lo + values * (hi - lo)), exact, atol=1e-6)


@pytest.mark.parametrize(
    "own",
    [
        *((-1000.0, 1500.0), (-2000.0, 9000.0), (100.0, 200.0), (-1024.0, 3071.0)),
        # Some tens of HU in a CT: the range that is shown.
        *((0.0, 80.0), (20.0, 60.0), (10.0, 30.0)),
    ],
)
def test_what_fits_the_volume_keeps_its_range(own):
    narrow = own[1] - own[0] <= 80
    points = ((own[0], 0.0), (own[1], 0.2))
    tf = replace(over(*own), opacity=OpacityTF(own, points=points)) if narrow else over(*own)
    for volume in (CT, Volume(CT.voxels.astype(np.float32))):
        assert fit_to_volume(tf, volume) == tf
        assert fit_to_volume(tf, volume.over((0.0, 100.0))).scalar_range == own
    if narrow:
        wide = Volume(np.random.default_rng(3).integers(0, 65536, SHAPE).astype(np.uint16))
        assert fit_to_volume(tf, wide) == tf


@pytest.mark.parametrize("own", [(0.0, 1.0), (3071.0, 9000.0), (-1e6, 1e6), (5e4, 6e4)])
def test_what_means_nothing_to_the_volume_is_stretched(own):
    whole = over(*CT.data_range)
    fitted = fit_to_volume(over(*own), CT)
    assert fitted.scalar_range == CT.data_range
    np.testing.assert_allclose(fitted.opacity.sample(), whole.opacity.sample(), atol=1e-6)
    np.testing.assert_allclose(fitted.color.sample(), whole.color.sample(), atol=1e-6)
    assert fit_to_volume(RELATIVE, CT.over((0.0, 100.0))).scalar_range == (0.0, 100.0)


@pytest.mark.parametrize(
    "opacity",
    [
        OpacityTF((0.0, 65535.0), (GaussianMode(30025.0, 10.0, 0.5),)),
        OpacityTF(
            (0.0, 65535.0),
            points=((0.0, 0.0), (30005.0, 0.0), (30025.0, 0.3), (30026.0, 0.0), (65535.0, 0.0)),
        ),
    ],
)
def test_a_tf_over_all_values_of_16_bits_keeps_those_that_the_volume_has(opacity):
    voxels = np.random.default_rng(3).integers(30000, 30049, (20, 20, 20)).astype(np.uint16)
    stops = ((0.0, 0.0, 0.0, 1.0), (65535.0, 1.0, 0.0, 0.0))
    tf = TransferFunction(opacity, ColorTF((0.0, 65535.0), stops))
    fitted = fit_to_volume(tf, Volume(voxels))
    assert fitted.scalar_range == (30000.0, 30048.0)
    values = np.linspace(30000, 30048, 97)
    # Over 65,536 values the mode would be as wide as a bin.
    mode = 0.5 * np.exp(-(((values - 30025) / 10) ** 2))
    expected = mode if opacity.modes else opacity(values)
    np.testing.assert_allclose(fitted.opacity(values), expected, atol=1e-9)
    np.testing.assert_allclose(fitted.color(values), tf.color(values), atol=1e-9)
    # What says nothing about these values is stretched: a mode elsewhere, or as wide as a bin.
    for other in (GaussianMode(40000.0, 10.0, 0.5), GaussianMode(30025.0, 100.0, 0.5)):
        elsewhere = replace(tf, opacity=OpacityTF((0.0, 65535.0), (other,)))
        stretched = fit_to_volume(elsewhere, Volume(voxels)).opacity.modes[0].mean
        assert stretched == pytest.approx(30000 + 48 * other.mean / 65535)


OBLONG = 20, 24, 28


def noise(spread=2.5):
    return np.exp(spread * np.random.default_rng(8).normal(size=OBLONG)).astype(np.float32)


def offered(voxels, missing=None):
    return suits_logarithm(Volume(voxels, missing=missing).distribution)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint32", "float32", "float64"])
def test_voxels_are_the_logarithms(dtype):
    voxels = np.random.default_rng(1).integers(1, 127, OBLONG).astype(dtype)
    volume = Volume(voxels).on_scale("log")
    np.testing.assert_allclose(volume.voxels, np.log10(voxels.astype(float)), rtol=3e-7)
    assert volume.scale == "log" and volume.data_range == pytest.approx((0, math.log10(126)))


def test_what_has_no_logarithm_lies_at_the_start():
    voxels = noise()
    voxels[0, 0, :3] = 0.0, -5.0, -1e-30
    volume = Volume(voxels).on_scale("log")
    lowest = np.log10(voxels[voxels > 0].min())
    np.testing.assert_allclose(volume.voxels[0, 0, :3], lowest, rtol=1e-6)
    assert volume.data_range[0] == pytest.approx(lowest)


def test_missing_voxels_remain_missing_and_do_not_count():
    voxels, missing = noise(), np.zeros(OBLONG, bool)
    voxels[3] = 1e-9
    missing[3] = True
    volume = Volume(voxels, missing=missing).on_scale("log")
    assert volume.data_range[0] == pytest.approx(np.log10(voxels[~missing].min()))
    assert volume.missing_share == pytest.approx(1 / 20)
    around = np.log10(voxels[2:5:2, :3, :3])
    assert volume.voxels[3, 1, 1] == pytest.approx(around.mean(), abs=1e-5)
    assert volume.drawing_missing(True).on_scale("linear").draws_missing


def test_it_is_the_same_volume():
    volume = Volume(noise(), name="halo", units="Msun")
    log = volume.on_scale("log")
    assert log.fingerprint == volume.fingerprint
    assert (log.name, log.units) == ("halo", "Msun")
    assert log.linear is volume
    back = log.over((1.0, 2.0), "linear")
    assert back.voxels is volume.voxels and back.scalar_range == (1.0, 2.0)
    assert volume.over((-1.0, 2.0), "log").scalar_range == (-1.0, 2.0)
    assert Scene.of(log, 64).scale == "log"
    assert Scene.from_json(json.loads(json.dumps(asdict(Scene.of(log, 64))))).scale == "log"


@pytest.mark.parametrize("voxels", [-noise(), np.where(noise() > 1, -1.0, 7.0), noise() * 0 - 1])
def test_nothing_to_take_a_logarithm_of(voxels):
    voxels[0, 0, 0] = -2.0
    with pytest.raises(VolumeError, match="linear"):
        Volume(voxels).on_scale("log")


def test_it_is_offered_for_log_normal_values_alone():
    assert offered(noise())
    assert offered((noise() * 100).astype(np.uint32))
    zeros = noise()
    zeros[:9] = 0.0
    assert offered(zeros)
    fill = noise()
    fill[:9] = 1e9
    missing = np.zeros(OBLONG, bool)
    missing[:9] = True
    assert offered(fill, missing)
    assert not offered(noise(0.5))
    assert not offered(noise() - 5)
    assert not offered(np.random.default_rng(2).random(OBLONG))
    # Values close to one another and one far out: a narrower range shows these.
    hot = 100 + np.random.default_rng(2).random(OBLONG)
    hot[0, 0, 0] = 1e5
    assert not offered(hot)


@pytest.mark.parametrize(
    "places", [(-5.2, 4.7), (0.0, 3.0), (1.2, 2.3), (2.0, 2.1), (-300.0, 300.0), (4.0, 4.001)]
)
def test_ticks_lie_where_their_text_says(places):
    ticks = logarithmic_ticks(places)
    lo, hi = places
    assert 2 <= len(ticks) <= 14
    for place, text in ticks:
        assert -1e-6 <= place <= 1 + 1e-6
        wanted = math.log10(float(text))
        assert lo + place * (hi - lo) == pytest.approx(wanted, abs=1e-6 * (hi - lo))


def test_a_tf_brings_its_scale():
    volume = Volume(noise())
    log = volume.on_scale("log")
    tf = default_transfer_function(log.over((-2.0, 3.0)))
    assert fit_to_volume(tf, volume) == tf
    linear = default_transfer_function(volume.over(robust_range(volume)))
    assert fit_to_volume(linear, log) == linear
    # One over quite other values is stretched, and keeps its scale.
    far = TransferFunction(
        OpacityTF((200.0, 210.0), (GaussianMode(205.0, 1.0, 0.5),), scale="log"),
        color_tf_of_map("Viridis", (200.0, 210.0)),
    )
    fitted = fit_to_volume(far, volume)
    assert fitted.scale == "log" and fitted.scalar_range == pytest.approx(robust_range(log))
    with pytest.raises(VolumeError, match="logarithm"):
        fit_to_volume(tf, Volume(-noise()))


def test_ranges_and_windows_are_typed_in_the_data_s_units():
    log = Volume(noise()).on_scale("log")
    low, high = values_at(RangeChoice(1.0, 99.0, are_percentiles=True).of(log), "log")
    assert (low, high) == pytest.approx(tuple(np.percentile(log.linear.voxels, [1, 99])), rel=0.02)
    with pytest.raises(TfscopeError, match="above zero"):
        Scene.of(log, 64, scalar_window=(0.0, 10.0))


@given(st.floats(-1e9, 1e9), st.floats(1e-12, 1e12, exclude_min=True), st.floats(0, 1))
def test_the_text_is_right_to_within_a_bin(low, extent, part):
    high = low + extent
    if high - low < 1e-9 * max(abs(low), abs(high), 1e-300):
        return
    value = low + part * (high - low)
    error = abs(float(value_text(value, (low, high), "linear")) - value)
    assert error <= 1.001 * (high - low) / (TF_SAMPLES - 1)
