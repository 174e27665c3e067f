import math
from dataclasses import replace

import numpy as np
import pytest
from ramp import make_tf, make_volume

from model.scene.inputs import (
    SceneInputs,
    draw_inputs,
    encode_inputs,
    outside_range,
    rgb_to_lab,
    store_inputs,
)
from model.scene.orientation import home_view
from model.scene.scene import LightDirection, Scene
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import AXES, View, axis_direction

SCENE = Scene.of(make_volume(), image_size=16, scalar_window=(120.0, 180.0))


@pytest.mark.parametrize(
    ("view", "modes", "said"),
    [
        (View(azimuth=300.0, elevation=80.0, roll=-10.0, distance=0.4), (120.0, 180.0), ()),
        (View(elevation=-85.0), (130.0, 170.0), ("elevation -85°",)),
        (View(roll=11.0), (130.0, 170.0), ("roll 11°",)),
        (View(distance=0.3), (130.0, 170.0), ("distance 0.30",)),
        (View(distance=1.2), (130.0, 170.0), ("distance 1.20",)),
        (View(), (110.0, 190.0, 150.0), ("2 modes",)),
        (View(elevation=90.0, roll=20.0), (100.0,), ("elevation", "roll", "a mode")),
    ],
)
def test_what_lies_outside_is_named_in_one_line(view, modes, said):
    opacity, color = make_tf(*modes).opacity, make_tf().color
    text = outside_range(SceneInputs(view, opacity, color), SCENE)
    assert all(part in text for part in said) and "\n" not in text
    assert text.count(",") == max(len(said) - 1, 0) and bool(text) == bool(said)


def test_a_free_curve_is_named():
    opacity = OpacityTF((100.0, 200.0), points=((100.0, 0.0), (200.0, 1.0)))
    scene = replace(SCENE, tf_family="paper")
    inputs = SceneInputs(View(), opacity, ColorTF(opacity.scalar_range, ((100.0, 1, 1, 1),)))
    assert "free opacity curve" in outside_range(inputs, scene)
    assert outside_range(inputs, replace(scene, tf_family="drawn")) == ""


FIXED = Scene.of(make_volume(), 16, "direct")
MOVABLE = Scene.of(make_volume(), 16, "direct", movable_light=True)


def test_adding_an_input_leaves_the_draws_of_the_others_alone():
    one, other = (draw_inputs(np.random.default_rng(3), scene) for scene in (FIXED, MOVABLE))
    assert replace(other, light=None) == one


def test_a_movable_light_fills_its_range_and_is_seen_as_a_direction():
    rng = np.random.default_rng(1)
    inputs = [draw_inputs(rng, MOVABLE) for _ in range(400)]
    arrays = store_inputs(inputs, MOVABLE)
    lights = arrays["light"]
    for column, limit in ((0, 80.0), (1, 70.0)):
        assert np.abs(lights[:, column]).max() <= limit
        counts, _ = np.histogram(lights[:, column], bins=4, range=(-limit, limit))
        # Four quarters of 100, standard deviation 8.7.
        assert np.abs(counts - 100).max() < 5 * 8.7
    conditions = encode_inputs(arrays, MOVABLE)["conditions"]
    assert conditions.shape == (400, 8)
    azimuth, elevation = np.radians(lights.T)
    right, up = np.sin(azimuth) * np.cos(elevation), np.sin(elevation)
    np.testing.assert_allclose(conditions[:, 5:7], np.stack([right, up], axis=1), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(conditions[:, 5:], axis=1), 1, atol=1e-6)
    assert outside_range(inputs[0], MOVABLE) == ""


def test_a_light_that_is_not_given_is_the_scenes():
    inputs = SceneInputs.of(View(), make_tf())
    np.testing.assert_array_equal(store_inputs([inputs], MOVABLE)["light"], [[-30.0, 30.0]])


def test_a_light_outside_its_range_is_named():
    inputs = SceneInputs.of(View(), make_tf(), light=LightDirection(85.0, -75.0))
    text = outside_range(inputs, replace(MOVABLE, scalar_window=(120.0, 180.0)))
    assert "light azimuth 85°" in text
    assert "light elevation -75°" in text
    assert outside_range(inputs, replace(FIXED, scalar_window=(120.0, 180.0))) == ""


@pytest.mark.parametrize("up", AXES)
def test_views_of_a_scene_stand_upright(up):
    scene = Scene.of(make_volume(), 16, up=up)
    rng = np.random.default_rng(5)
    for _ in range(50):
        view = draw_inputs(rng, scene).view
        _, above, back = view.basis() @ axis_direction(up)
        assert above > 0
        assert abs(math.degrees(math.asin(back))) <= 80
        assert "roll" not in outside_range(SceneInputs.of(view, make_tf()), scene)
    home = home_view(scene.proportions, up)
    wide = replace(scene, scalar_window=scene.scalar_range)
    assert outside_range(SceneInputs.of(home, make_tf()), wide) == ""


def test_a_view_that_is_upside_down_is_told_with_the_axis():
    scene = Scene.of(make_volume(), 16, up="-z")
    text = outside_range(SceneInputs.of(View(30, 20), make_tf()), scene)
    assert "roll 180° (±10° with −z up)" in text.replace("roll -180", "roll 180")


def test_known_colours():
    # CIELAB of sRGB red under D65, from the standard's formulas: L 53.24, a 80.09, b 67.20.
    red = rgb_to_lab(np.array([1.0, 0.0, 0.0], np.float32))
    expected = [
        53.24 / 50 - 1,
        2 * (80.09 + 86.185) / 184.439 - 1,
        2 * (67.20 + 107.863) / 202.345 - 1,
    ]
    np.testing.assert_allclose(red, expected, atol=1e-3)
    # Those outside the cube are clipped, not NaN.
    wild = np.array([[-3.0, 0.5, 7.0], [1.001, -1e-9, 0.2]], np.float32)
    np.testing.assert_array_equal(rgb_to_lab(wild), rgb_to_lab(np.clip(wild, 0, 1)))
    assert np.isfinite(rgb_to_lab(wild)).all()
