from dataclasses import replace

import numpy as np
import pytest

from model.scene.range_fitting import fit_to_range, fit_to_volume
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.volume import Volume

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


def test_the_own_range_changes_nothing():
    assert fit_to_range(MODES, (0.0, 100.0)) == MODES
    assert fit_to_range(CURVE, (0.0, 100.0)) == CURVE


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


def test_fractions_stay_fractions_over_the_range_of_fractions():
    fitted = fit_to_range(RELATIVE, (0.0, 1.0))
    assert fitted == replace(RELATIVE, is_relative=False)


@pytest.mark.parametrize(
    "own", [(-1000.0, 1500.0), (-2000.0, 9000.0), (100.0, 200.0), (-1024.0, 3071.0)]
)
def test_what_fits_the_volume_keeps_its_range(own):
    tf = over(*own)
    assert fit_to_volume(tf, CT) == tf
    assert fit_to_volume(tf, CT.over((0.0, 100.0))).scalar_range == own


@pytest.mark.parametrize("own", [(0.0, 1.0), (3071.0, 9000.0), (-1e6, 1e6), (5e4, 6e4)])
def test_what_means_nothing_to_the_volume_is_stretched(own):
    whole = over(*CT.data_range)
    fitted = fit_to_volume(over(*own), CT)
    assert fitted.scalar_range == CT.data_range
    np.testing.assert_allclose(fitted.opacity.sample(), whole.opacity.sample(), atol=1e-6)
    np.testing.assert_allclose(fitted.color.sample(), whole.color.sample(), atol=1e-6)
    assert fit_to_volume(RELATIVE, CT.over((0.0, 100.0))).scalar_range == (0.0, 100.0)


def test_a_tf_from_before_an_outlier_was_ignored_keeps_its_meaning():
    voxels = CT.voxels.astype(np.float64)
    voxels[0, 0, 0] = 1e30
    volume = Volume(voxels)
    for own in [(-1023.0, 3071.0), (0.0, 100.0), (0.0, 1e30)]:
        assert fit_to_volume(over(*own), volume.over((2000.0, 2010.0))).scalar_range == own


@pytest.mark.parametrize("dtype", ["int16", "float32"])
@pytest.mark.parametrize("own", [(0.0, 80.0), (20.0, 60.0), (10.0, 30.0)])
def test_a_narrow_window_keeps_its_values(own, dtype):
    """Of some tens of HU in a CT, or of units in 16 bits: the range that is shown."""
    random = np.random.default_rng(3)
    ct = Volume(random.integers(-1024, 2987, (20, 20, 20)).astype(dtype))
    tf = TransferFunction(
        OpacityTF(own, points=((own[0], 0.0), (own[1], 0.2))),
        ColorTF(own, ((own[0], 0.0, 0.0, 1.0), (own[1], 1.0, 1.0, 1.0))),
    )
    assert fit_to_volume(tf, ct) == tf
    wide = Volume(random.integers(0, 65536, (20, 20, 20)).astype(np.uint16))
    assert fit_to_volume(tf, wide) == tf


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
