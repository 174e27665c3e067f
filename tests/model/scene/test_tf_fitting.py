import numpy as np
import pytest

from model.scene.random_tfs import SHARES, opacity_tf_of
from model.scene.scene import Scene
from model.scene.tf_fitting import fitted_curve, fitted_modes, tf_difference
from model.scene.transfer_function import GaussianMode, OpacityTF

RANGE = (-50.0, 150.0)
SCENE = Scene("any", "", RANGE, RANGE, image_size=16)


def sampled(tf):
    """The same TF with a point at each of 256 values."""
    values = np.linspace(*RANGE, 256).tolist()
    heights = np.clip(tf.sample(), 0, 1).tolist()
    return OpacityTF(RANGE, points=tuple(zip(values, heights, strict=True)))


@pytest.mark.parametrize("kind", SHARES)
def test_a_curve_of_few_points_is_close(kind):
    rng = np.random.default_rng(0)
    for _ in range(5):
        tf = sampled(opacity_tf_of(kind, rng, SCENE))
        curve = fitted_curve(tf)
        largest = np.abs(np.sqrt(curve.sample()) - np.sqrt(tf.sample())).max()
        assert largest <= 0.021
        assert len(curve.points) <= 64


def test_a_jump_stays_a_jump():
    points = ((0.0, 0.0), (20.0, 0.0), (20.0, 0.6), (40.0, 0.6), (60.0, 0.6), (80.0, 0.0))
    curve = fitted_curve(OpacityTF(RANGE, points=points))
    assert curve.points == tuple(p for p in points if p[0] != 40.0)


def test_modes_are_found_again():
    modes = (GaussianMode(0, 10, 0.6), GaussianMode(60, 25, 0.2), GaussianMode(110, 6, 0.03))
    found = fitted_modes(sampled(OpacityTF(RANGE, modes)))
    assert len(found.modes) == 3
    for mode, expected in zip(found.modes, modes, strict=True):
        assert mode.mean == pytest.approx(expected.mean, abs=0.3)
        assert mode.width == pytest.approx(expected.width, rel=0.03)
        assert mode.amplitude == pytest.approx(expected.amplitude, rel=0.03, abs=2e-3)


@pytest.mark.parametrize("kind", ["ramp", "plateau", "band", "curve", "constant"])
def test_modes_come_near_what_is_no_mode(kind):
    rng = np.random.default_rng(1)
    differences = []
    for _ in range(5):
        tf = sampled(opacity_tf_of(kind, rng, SCENE))
        found = fitted_modes(tf)
        assert len(found.modes) <= 5
        differences.append(tf_difference(found, tf) / max(float(tf.sample().max()), 0.01))
    assert np.median(differences) < 0.1


def test_nothing_has_no_modes():
    assert fitted_modes(OpacityTF(RANGE, points=((0.0, 0.0), (1.0, 0.001)))).modes == ()


def test_the_difference_is_the_root_mean_square():
    one = OpacityTF(RANGE, points=((0.0, 0.3),))
    other = OpacityTF(RANGE, points=((0.0, 0.1),))
    assert tf_difference(one, other) == pytest.approx(0.2)
