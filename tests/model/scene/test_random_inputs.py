import colorsys
from typing import get_args

import numpy as np
import pytest

from model.samples.sampling import draw_sample, sample_kind, sample_rng
from model.scene import random_inputs
from model.scene.scene import Scene
from model.scene.tf_editing import fitted_curve, fitted_modes
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.scene.view import ViewRange

RANGE, WINDOW = (-1000.0, 1500.0), (-500.0, 1000.0)
SCENE = Scene("v", "f", RANGE, WINDOW, 64)
PAPER = Scene("v", "f", RANGE, WINDOW, 64, tf_family="paper")


def test_kinds_have_their_shares():
    assert set(random_inputs.SHARES) == set(get_args(random_inputs.OpacityKind))
    assert sum(random_inputs.SHARES.values()) == pytest.approx(1)
    rng = np.random.default_rng(1)
    kinds = [random_inputs.draw_kind(rng, SCENE) for _ in range(5000)]
    for kind, share in random_inputs.SHARES.items():
        assert kinds.count(kind) / 5000 == pytest.approx(share, abs=0.03)


def test_the_papers_family_draws_its_mixtures_as_before():
    one, other = np.random.default_rng(5), np.random.default_rng(5)
    for _ in range(20):
        expected = random_inputs.opacity_tf_of("modes", other, PAPER)
        assert random_inputs.draw_opacity_tf(one, PAPER) == expected


def test_a_samples_kind_is_that_of_its_tf():
    for index in range(60):
        kind = sample_kind(SCENE, 3, "holdout", index)
        tf = draw_sample(SCENE, 3, "holdout", index).opacity_tf
        assert bool(tf.points) == (kind not in ("modes", "nearly empty", "empty"))
        assert (not tf.points and not tf.modes) == (kind == "empty")
        assert sample_kind(PAPER, 3, "holdout", index) == "modes"


SPAN = (-50.0, 150.0)
ANY = Scene("any", "", SPAN, SPAN, image_size=16)


def densely(tf):
    """The same TF with a point at each of 256 values."""
    values = np.linspace(*SPAN, 256).tolist()
    heights = np.clip(tf.sample(), 0, 1).tolist()
    return OpacityTF(SPAN, points=tuple(zip(values, heights, strict=True)))


@pytest.mark.parametrize("kind", random_inputs.SHARES)
def test_a_curve_of_few_points_is_close(kind):
    rng = np.random.default_rng(0)
    for _ in range(5):
        tf = densely(random_inputs.opacity_tf_of(kind, rng, ANY))
        curve = fitted_curve(tf)
        largest = np.abs(np.sqrt(curve.sample()) - np.sqrt(tf.sample())).max()
        assert largest <= 0.021
        assert len(curve.points) <= 64


def test_a_jump_stays_a_jump():
    points = ((0.0, 0.0), (20.0, 0.0), (20.0, 0.6), (40.0, 0.6), (60.0, 0.6), (80.0, 0.0))
    curve = fitted_curve(OpacityTF(SPAN, points=points))
    assert curve.points == tuple(p for p in points if p[0] != 40.0)


def test_modes_are_found_again():
    rows = (0, 10, 0.6), (60, 25, 0.2), (110, 6, 0.03), (135, 6, 0.003)
    modes = tuple(GaussianMode(*row) for row in rows)
    found = fitted_modes(densely(OpacityTF(SPAN, modes)))
    assert len(found.modes) == len(modes)
    for mode, expected in zip(found.modes, modes, strict=True):
        assert mode.mean == pytest.approx(expected.mean, abs=0.3)
        assert mode.width == pytest.approx(expected.width, rel=0.03)
        assert mode.amplitude == pytest.approx(expected.amplitude, rel=0.03, abs=2e-3)


DRAWS = 2000


def opacity_tfs():
    rng = np.random.default_rng(0)
    return [random_inputs.draw_opacity_tf(rng, PAPER) for _ in range(DRAWS)]


def test_a_sample_depends_on_seed_split_and_index_only(scene):
    first = [draw_sample(scene, 3, "train", i) for i in (5, 6, 7)]
    again = [draw_sample(scene, 3, "train", i) for i in (7, 5)]
    assert (first[2], first[0]) == (again[0], again[1])
    assert draw_sample(scene, 3, "holdout", 5) != first[0]
    assert draw_sample(scene, 4, "train", 5) != first[0]


def test_splits_never_meet():
    bits = {
        sample_rng(seed, split, i).bit_generator.random_raw()
        for seed in (0, 1)
        for split in ("train", "holdout")
        for i in range(500)
    }
    assert len(bits) == 2000


def test_views_fill_the_range_evenly(scene):
    views = [draw_sample(scene, 0, "train", i).view for i in range(DRAWS)]
    limits = ViewRange()
    for name, lo, hi in (
        ("azimuth", 0, 360),
        ("elevation", -limits.max_elevation, limits.max_elevation),
        ("roll", -limits.max_roll, limits.max_roll),
        ("distance", limits.nearest, limits.farthest),
    ):
        values = np.array([getattr(view, name) for view in views])
        counts, _ = np.histogram(values, bins=4, range=(lo, hi))
        assert counts.sum() == DRAWS
        # Four quarters of 500, standard deviation 19.4.
        assert np.abs(counts - DRAWS / 4).max() < 5 * 19.4


def test_modes_keep_their_limits():
    lo, hi = RANGE
    for tf in opacity_tfs():
        for mode in tf.modes:
            assert WINDOW[0] <= mode.mean <= WINDOW[1]
            floor = 2 * (hi - lo) / 256
            assert floor <= mode.width <= max(floor, min(mode.mean - lo, hi - mode.mean) / 2)
        amplitudes = [mode.amplitude for mode in tf.modes]
        if len(amplitudes) == 1:
            assert 0.1 <= amplitudes[0] <= 1
        else:
            assert sum(amplitudes) == pytest.approx(1)


def test_modes_are_light_and_the_ends_dark():
    rng = np.random.default_rng(1)
    for tf in opacity_tfs()[:300]:
        color = random_inputs.draw_color_tf(rng, PAPER, tf)
        lightness = [colorsys.rgb_to_hls(*stop[1:])[1] for stop in color.stops]
        assert max(lightness[0], lightness[-1]) <= 0.4 + 1e-9
        assert min(lightness[1:-1]) >= 0.6 - 1e-9
        assert [stop[0] for stop in color.stops[1:-1]] == sorted(m.mean for m in tf.modes)
        assert (color.stops[0][0], color.stops[-1][0]) == RANGE
