"""The logarithmic scale, against NumPy's logarithm."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.errors import TfscopeError, VolumeError
from model.scene.default_tf import default_transfer_function
from model.scene.ranges import RangeChoice, fit_to_volume, range_text, robust_range, value_text
from model.scene.scene import Scene
from model.scene.tf_presets import color_tf_of_map
from model.scene.transfer_function import TF_SAMPLES, GaussianMode, OpacityTF, TransferFunction
from model.scene.value_scale import logarithmic_ticks, suits_logarithm, values_at
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

SHAPE = 20, 24, 28


def noise(spread=2.5):
    return np.exp(spread * np.random.default_rng(8).normal(size=SHAPE)).astype(np.float32)


def offered(voxels, missing=None):
    return suits_logarithm(Volume(voxels, missing=missing).distribution)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint32", "float32", "float64"])
def test_voxels_are_the_logarithms(dtype):
    voxels = np.random.default_rng(1).integers(1, 127, SHAPE).astype(dtype)
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
    voxels, missing = noise(), np.zeros(SHAPE, bool)
    voxels[3] = 1e-9
    missing[3] = True
    volume = Volume(voxels, missing=missing).on_scale("log")
    assert volume.data_range[0] == pytest.approx(np.log10(voxels[~missing].min()))
    assert volume.missing_share == pytest.approx(1 / 20)
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
    assert Scene.from_json(json.loads(json.dumps(Scene.of(log, 64).to_json()))).scale == "log"


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
    missing = np.zeros(SHAPE, bool)
    missing[:9] = True
    assert offered(fill, missing)
    assert not offered(noise(0.5))
    assert not offered(noise() - 5)
    assert not offered(np.random.default_rng(2).random(SHAPE))
    # Values close to one another and one far out: a narrower range shows these.
    hot = 100 + np.random.default_rng(2).random(SHAPE)
    hot[0, 0, 0] = 1e5
    assert not offered(hot)


@pytest.mark.parametrize("path", shipped_volumes(), ids=lambda path: path.stem)
def test_it_is_not_offered_for_what_is_shipped(path):
    assert not suits_logarithm(read_volume(path).distribution)


@pytest.mark.parametrize(
    "places", [(-5.2, 4.7), (0.0, 3.0), (1.2, 2.3), (2.0, 2.1), (-300.0, 300.0), (4.0, 4.001)]
)
def test_ticks_lie_where_their_text_says(places):
    ticks = logarithmic_ticks(places)
    lo, hi = places
    assert 2 <= len(ticks) <= 14
    for place, text in ticks:
        assert -1e-6 <= place <= 1 + 1e-6
        assert lo + place * (hi - lo) == pytest.approx(
            math.log10(float(text)), abs=1e-6 * (hi - lo)
        )


@pytest.mark.parametrize(
    ("value", "text"), [(1234.0, "1234"), (0.0123, "0.0123"), (1.5, "1.50"), (2.5e9, "2.5e+09")]
)
def test_values_are_written_in_their_own_units(value, text):
    shown = value_text(math.log10(value), (-5.0, 10.0), "log")
    assert shown == text or float(shown) == pytest.approx(float(text), rel=0.1)
    # To within one of 256 steps.
    assert abs(math.log10(float(shown)) - math.log10(value)) < 15 / 255
    assert "e" not in range_text((0.0, 3.0), (-5.0, 10.0), "log")


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
    assert RangeChoice(0.01, 1000.0).of(log) == pytest.approx((-2.0, 3.0))
    low, high = values_at(RangeChoice(1.0, 99.0, are_percentiles=True).of(log), "log")
    assert (low, high) == pytest.approx(tuple(np.percentile(log.linear.voxels, [1, 99])), rel=0.02)
    with pytest.raises(VolumeError, match="above zero"):
        RangeChoice(-1.0, 5.0).of(log)
    assert Scene.of(log, 64, scalar_window=(0.1, 10.0)).scalar_window == pytest.approx((-1, 1))
    with pytest.raises(TfscopeError, match="above zero"):
        Scene.of(log, 64, scalar_window=(0.0, 10.0))


@pytest.mark.parametrize(
    ("value", "scalar_range", "text"),
    [
        (67.4666, (0.0, 255.0), "67"), (-612.2, (-1024.0, 3071.0), "-612"),
        (0.6127, (0.0, 1.0), "0.613"), (2.3254e-8, (0.0, 1e-7), "2.33e-08"),
        (1234567.8, (0.0, 2e6), "1.23e+06"), (-0.0001, (-1.0, 1.0), "0.00"),
        (0.0, (0.0, 1e-9), "0"),
    ],
)  # fmt: skip
def test_as_many_digits_as_a_tf_tells_apart(value, scalar_range, text):
    assert value_text(value, scalar_range, "linear") == text


@given(st.floats(-1e9, 1e9), st.floats(1e-12, 1e12, exclude_min=True), st.floats(0, 1))
def test_the_text_is_right_to_within_a_bin(low, extent, part):
    high = low + extent
    if high - low < 1e-9 * max(abs(low), abs(high), 1e-300):
        return
    value = low + part * (high - low)
    error = abs(float(value_text(value, (low, high), "linear")) - value)
    assert error <= 1.001 * (high - low) / (TF_SAMPLES - 1)


@pytest.mark.parametrize(
    ("values", "scalar_range", "text"),
    [
        ((260.2, 1899.7), (-1024.0, 3071.0), "260 to 1,900"),
        ((-1000.0, -612.0), (-1024.0, 3071.0), "-1,000 to -612"),
        ((0.25, 0.5), (0.0, 1.0), "0.250 to 0.500"),
        ((67.4, 66.8), (0.0, 255.0), "67"),
        ((1e-8, 2e-8), (0.0, 1e-7), "1e-08 to 2e-08"),
    ],
)
def test_ranges_have_their_thousands_set_apart(values, scalar_range, text):
    assert range_text(values, scalar_range, "linear") == text
