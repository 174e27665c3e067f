import colorsys

import numpy as np
import pytest

from model.scene.default_tf import default_transfer_function
from model.scene.scene import default_scalar_window
from model.scene.volume import Volume


def uniform(lo, hi):
    return Volume(np.linspace(lo, hi, 32**3).reshape(32, 32, 32))


def test_modes_lie_in_the_window_with_light_colors_and_a_dark_low_end(volume):
    tf = default_transfer_function(volume)
    lo, hi = default_scalar_window(volume)
    means = [mode.mean for mode in tf.opacity.modes]
    assert means == sorted(means)
    assert all(lo <= mean <= hi for mean in means)
    assert tf.scalar_range == volume.scalar_range
    assert [s[0] for s in tf.color.stops[1:-1]] == means
    lightness = [colorsys.rgb_to_hls(*stop[1:])[1] for stop in tf.color.stops]
    assert lightness[0] < 0.4
    assert min(lightness[1:]) > 0.6


@pytest.mark.parametrize("thickness", [1.0, 3.0, 12.0])
def test_a_hollow_ball_is_opaque_enough_to_be_seen(thickness):
    random = np.random.default_rng(0)
    radius = np.linalg.norm(np.indices((48, 48, 48)) - 23.5, axis=0)
    inside = np.abs(radius - 16.0) < thickness / 2
    air, wall = random.normal(20.0, 2.0, inside.shape), random.normal(150.0, 15.0, inside.shape)
    opacity = default_transfer_function(Volume(np.where(inside, wall, air))).opacity
    rays = 1 - np.prod(1 - opacity(np.where(inside, wall, air)), axis=2)
    assert np.median(rays[inside.any(axis=2)]) > 0.85
    assert np.median(rays[~inside.any(axis=2)]) < 0.5


@pytest.mark.parametrize("limits", [(0.0, 1.0), (-1000.0, 3000.0), (1e-9, 3e-9), (0.0, 1e12)])
def test_the_default_follows_the_units_of_the_data(limits):
    lo, hi = limits
    places = [
        (m.mean - lo) / (hi - lo) for m in default_transfer_function(uniform(lo, hi)).opacity.modes
    ]
    unit = [m.mean for m in default_transfer_function(uniform(0.0, 1.0)).opacity.modes]
    assert places == pytest.approx(unit, abs=0.01)


def test_what_fills_the_volume_is_shown_less():
    scalars = np.linspace(0.0, 1.0, 32**3).reshape(32, 32, 32)
    plain = default_transfer_function(Volume(scalars))
    crowded_at = plain.opacity.modes[1].mean
    crowded = scalars.copy()
    crowded[4:12] = crowded_at
    tf = default_transfer_function(Volume(crowded))
    assert tf.opacity(crowded_at) < plain.opacity(crowded_at) / 1.5


@pytest.mark.parametrize("high", [1, 3, 255])
def test_two_values_are_enough(high):
    scalars = np.zeros((4, 4, 4), dtype=np.uint8)
    scalars[2:] = high
    tf = default_transfer_function(Volume(scalars))
    assert np.isfinite(tf.opacity.sample()).all()
