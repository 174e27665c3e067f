import colorsys

import numpy as np
import pytest

from model.samples.sampling import draw_edits, draw_opacity_tfs, draw_sample, sample_rng
from model.scene.random_inputs import draw_color_tf, draw_opacity_tf
from model.scene.scene import Scene
from model.scene.view import ViewRange

RANGE, WINDOW = (-1000.0, 1500.0), (-500.0, 1000.0)
DRAWS = 2000
PAPER = Scene("v", "f", RANGE, WINDOW, 64, tf_family="paper")


def opacity_tfs():
    rng = np.random.default_rng(0)
    return [draw_opacity_tf(rng, PAPER) for _ in range(DRAWS)]


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


def test_tfs_on_their_own_are_drawn_like_those_of_samples(scene):
    tfs = draw_opacity_tfs(scene, 0, 4, 300)
    assert tfs.shape == (300, 256)
    assert tfs.min() >= 0
    assert tfs.max() <= 1
    assert np.array_equal(tfs, draw_opacity_tfs(scene, 0, 4, 300))
    of_samples = [draw_sample(scene, 0, "train", i).transfer_function for i in range(300)]
    values = np.stack([tf.opacity.sample(scene.scalar_range) for tf in of_samples])
    showing = values[values.any(axis=1)]
    assert not (tfs[:, None] == showing[None]).all(axis=2).any()
    difference = np.abs(tfs.mean(axis=0) - values.mean(axis=0))
    error = np.hypot(tfs.std(axis=0), values.std(axis=0)) / np.sqrt(300)
    assert (difference < 5 * error + 1e-6).all()


def test_modes_are_light_and_the_ends_dark():
    rng = np.random.default_rng(1)
    for tf in opacity_tfs()[:300]:
        color = draw_color_tf(rng, PAPER, tf)
        lightness = [colorsys.rgb_to_hls(*stop[1:])[1] for stop in color.stops]
        assert max(lightness[0], lightness[-1]) <= 0.4 + 1e-9
        assert min(lightness[1:-1]) >= 0.6 - 1e-9
        assert [stop[0] for stop in color.stops[1:-1]] == sorted(m.mean for m in tf.modes)
        assert (color.stops[0][0], color.stops[-1][0]) == RANGE


def test_edits_are_bumps_of_one_height_around_values_of_the_window():
    scene = Scene("v", "f", RANGE, WINDOW, 64)
    edits = draw_edits(scene, 4, 0, 400).astype(np.float64)
    peaks = edits[np.arange(400), np.abs(edits).argmax(axis=1)]
    assert np.allclose(np.abs(peaks), 0.1, rtol=0.02)
    assert 150 < (peaks > 0).sum() < 250
    values = np.linspace(*RANGE, 256)[np.abs(edits).argmax(axis=1)]
    step = (RANGE[1] - RANGE[0]) / 255
    assert WINDOW[0] - step < values.min() < WINDOW[0] + 0.1 * (WINDOW[1] - WINDOW[0])
    assert WINDOW[1] - 0.1 * (WINDOW[1] - WINDOW[0]) < values.max() < WINDOW[1] + step
    # A Gaussian of height h and standard deviation w sums up to h w sqrt(2 pi).
    middle = np.abs(values - np.mean(RANGE)) < 0.1 * (RANGE[1] - RANGE[0])
    widths = np.abs(edits[middle].sum(axis=1)) / 0.1 / np.sqrt(2 * np.pi)
    assert 2.9 < widths.min() < 4
    assert 18 < widths.max() < 24.1
    assert 7 < np.median(widths) < 10
    assert np.array_equal(draw_edits(scene, 4, 0, 400), edits.astype(np.float32))
    assert not np.array_equal(draw_edits(scene, 4, 1, 400), edits.astype(np.float32))
