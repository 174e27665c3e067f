from typing import get_args

import numpy as np
import pytest

from model.samples.sampling import draw_sample, sample_kind
from model.scene.random_inputs import (
    COLOR_MAPS,
    SHARES,
    OpacityKind,
    draw_color_tf,
    draw_kind,
    draw_opacity_tf,
    opacity_tf_of,
)
from model.scene.scene import Scene
from model.scene.tf_editing import fitted_curve, fitted_modes
from model.scene.transfer_function import GaussianMode, OpacityTF

RANGE, WINDOW = (-1000.0, 1500.0), (-500.0, 1000.0)
SCENE = Scene("v", "f", RANGE, WINDOW, 64)
PAPER = Scene("v", "f", RANGE, WINDOW, 64, tf_family="paper")
BIN = (RANGE[1] - RANGE[0]) / 256


def drawn(kind, count=200):
    rng = np.random.default_rng(0)
    return [opacity_tf_of(kind, rng, SCENE) for _ in range(count)]


def sampled(kind):
    return np.stack([tf.sample() for tf in drawn(kind)])


def test_kinds_have_their_shares():
    assert set(SHARES) == set(get_args(OpacityKind))
    assert sum(SHARES.values()) == pytest.approx(1)
    rng = np.random.default_rng(1)
    kinds = [draw_kind(rng, SCENE) for _ in range(5000)]
    for kind, share in SHARES.items():
        assert kinds.count(kind) / 5000 == pytest.approx(share, abs=0.03)


def test_the_papers_family_draws_its_mixtures_as_before():
    one, other = np.random.default_rng(5), np.random.default_rng(5)
    for _ in range(20):
        assert draw_opacity_tf(one, PAPER) == opacity_tf_of("modes", other, PAPER)


def test_a_samples_kind_is_that_of_its_tf():
    for index in range(60):
        kind = sample_kind(SCENE, 3, "holdout", index)
        tf = draw_sample(SCENE, 3, "holdout", index).opacity_tf
        assert bool(tf.points) == (kind not in ("modes", "nearly empty", "empty"))
        assert (not tf.points and not tf.modes) == (kind == "empty")
        assert sample_kind(PAPER, 3, "holdout", index) == "modes"


@pytest.mark.parametrize("kind", SHARES)
def test_opacities_change_inside_the_window_only(kind):
    for tf in drawn(kind, 50):
        values = [value for value, _ in tf.points]
        assert all(WINDOW[0] <= v <= WINDOW[1] + 9 * BIN for v in values) or kind == "constant"
        assert all(0 <= opacity <= 1 for _, opacity in tf.points)


@pytest.mark.parametrize("kind", ["ramp", "plateau", "step"])
def test_ramps_rise_and_stay(kind):
    values = sampled(kind)
    assert (np.diff(values, axis=1) >= 0).all()
    assert not values[:, 0].any()
    assert values[:, -1].min() >= 0.01
    widths = ((values > 0) & (values < values[:, -1:])).sum(axis=1)
    assert (widths.max() <= 3) == (kind == "step")


def test_bands_rise_and_fall():
    values = sampled("band")
    assert not values[:, [0, -1]].any()
    rises = np.sign(np.diff(values, axis=1))
    for row in rises:
        signs = row[row != 0]
        assert (np.diff(signs) <= 0).all()


def test_constants_are_one_opacity_over_three_decades_and_others_show_little_or_nothing():
    values = sampled("constant")
    assert (np.ptp(values, axis=1) == 0).all()
    assert values.min() < 0.002 < 0.5 < values.max()
    assert not sampled("empty").any()
    faint = sampled("nearly empty")
    assert faint.max() <= 0.01 * 5
    assert faint.any(axis=1).all()


def test_colors_are_common_maps_or_random():
    rng = np.random.default_rng(2)
    ends = {tuple(map(float, colors[0])) for colors in COLOR_MAPS.values()}
    ends |= {tuple(map(float, colors[-1])) for colors in COLOR_MAPS.values()}
    opacity = opacity_tf_of("band", rng, SCENE)
    firsts = [draw_color_tf(rng, SCENE, opacity).stops[0][1:] for _ in range(500)]
    common = sum(tuple(map(float, first)) in ends for first in firsts)
    assert 0.33 < common / 500 < 0.47
    rng = np.random.default_rng(2)
    assert not any(
        tuple(map(float, draw_color_tf(rng, PAPER, opacity).stops[0][1:])) in ends
        for _ in range(200)
    )


SPAN = (-50.0, 150.0)
ANY = Scene("any", "", SPAN, SPAN, image_size=16)


def densely(tf):
    """The same TF with a point at each of 256 values."""
    values = np.linspace(*SPAN, 256).tolist()
    heights = np.clip(tf.sample(), 0, 1).tolist()
    return OpacityTF(SPAN, points=tuple(zip(values, heights, strict=True)))


@pytest.mark.parametrize("kind", SHARES)
def test_a_curve_of_few_points_is_close(kind):
    rng = np.random.default_rng(0)
    for _ in range(5):
        tf = densely(opacity_tf_of(kind, rng, ANY))
        curve = fitted_curve(tf)
        largest = np.abs(np.sqrt(curve.sample()) - np.sqrt(tf.sample())).max()
        assert largest <= 0.021
        assert len(curve.points) <= 64


def test_a_jump_stays_a_jump():
    points = ((0.0, 0.0), (20.0, 0.0), (20.0, 0.6), (40.0, 0.6), (60.0, 0.6), (80.0, 0.0))
    curve = fitted_curve(OpacityTF(SPAN, points=points))
    assert curve.points == tuple(p for p in points if p[0] != 40.0)


def test_modes_are_found_again():
    modes = (GaussianMode(0, 10, 0.6), GaussianMode(60, 25, 0.2), GaussianMode(110, 6, 0.03))
    found = fitted_modes(densely(OpacityTF(SPAN, modes)))
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
        tf = densely(opacity_tf_of(kind, rng, ANY))
        found = fitted_modes(tf)
        assert len(found.modes) <= 5
        missed = np.sqrt(np.square(found.sample() - tf.sample()).mean())
        differences.append(missed / max(float(tf.sample().max()), 0.01))
    assert np.median(differences) < 0.1


def test_nothing_has_no_modes():
    assert fitted_modes(OpacityTF(SPAN, points=((0.0, 0.0), (1.0, 0.001)))).modes == ()
