import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ramp import make_tf, make_volume

from model.errors import RenderError, TfscopeError
from model.scene.crop import CropBox
from model.scene.inputs import (
    SceneInputs,
    draw_inputs,
    encode_inputs,
    outside_range,
    rgb_to_lab,
    store_inputs,
)
from model.scene.orientation import home_view, standard_view, view_in
from model.scene.ranges import RangeChoice
from model.scene.region import Outline, Region, windows_of
from model.scene.scene import LightDirection, Scene
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import AXES, View, ViewRange, axis_direction

GOOD = {
    "0,0.5,0.25,1,0.1,0.9": CropBox((0.0, 0.25, 0.1), (0.5, 1.0, 0.9)),
    # 0.105 - 0.1 is a little less than 0.005.
    "0.1,0.105,0,1,0,1": CropBox((0.1, 0.0, 0.0), (0.105, 1.0, 1.0)),
    "-100,1500.5": RangeChoice(-100, 1500.5),
    "1%, 99.5%": RangeChoice(1, 99.5, are_percentiles=True),
    "30,-20,5,0.8": View(30.0, -20.0, 5.0, 0.8),
    "30": View(30.0),
    "30, -20,5,0.8 ,orthographic": View(30.0, -20.0, 5.0, 0.8, is_orthographic=True),
    "100,80, 140,120": Region(100, 80, 140, 120),
    "30, -10": LightDirection(30.0, -10.0),
}
BAD = [
    (CropBox, "crop box",
     ["", "0,1", "0,1,0,1,0,x", "0,1,0,1,0,1.5", "0.5,0.5,0,1,0,1", "0.6,0.2,0,1,0,1"]),
    (RangeChoice, "range|percentiles",
     ["", "1", "1,2,3", "a,b", "5,1", "nan,1", "1%,2", "-1%,50%", "1%,101%", "0,inf"]),
    (View, "is not a view", ["north", "1,2,3,4,5,6,7", "", "orthographic", "1,flat"]),
    (View, "from -90 to 90", ["0,91,0,1"]),
    (View, "above 0", ["0,0,0,0"]),
    (View, "finite", ["nan,0,0,1"]),
    (Region, "is not a region; give left,top,right,bottom",
     ["", "1,2,3", "1,2,3,4,5", "1,2,3,x", "1.5,2,3,4"]),
    (LightDirection, "degrees", ["", "1", "1,2,3", "a,b", "nan,1"]),
]  # fmt: skip


@pytest.mark.parametrize("text", GOOD)
def test_what_is_typed_is_read(text):
    assert type(GOOD[text]).parse(text) == GOOD[text]


@pytest.mark.parametrize(("kind", "message", "texts"), BAD)
def test_what_cannot_be_read_is_refused(kind, message, texts):
    for text in texts:
        with pytest.raises(TfscopeError, match=message):
            kind.parse(text)


SCENE = Scene.of(make_volume(), 16)


@pytest.mark.parametrize("lighting", ["none", "direct", "soft", "path"])
def test_a_scene_survives_json(lighting):
    for movable in (False, True)[: 1 + (lighting != "none")]:
        scene = Scene.of(make_volume(), 128, lighting, movable_light=movable, up="-y")
        assert Scene.from_json(json.loads(json.dumps(asdict(scene)))) == scene
        assert (scene.light is None) == (lighting == "none")


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: replace(SCENE, lighting="shadows"), "unknown; choose none, direct, soft or path"),
        (lambda: replace(SCENE, light=LightDirection()), "unlit"),
        (lambda: replace(SCENE, lighting="direct"), "light direction"),
        (lambda: replace(SCENE, scalar_range=(1.0, 1.0)), "not increasing"),
        (lambda: replace(SCENE, scalar_window=(-5.0, 10.0)), "scalar window"),
        (lambda: replace(SCENE, scalar_window=(10.0, 5.0)), "scalar window"),
        (lambda: replace(SCENE, image_size=8), "16 to 4096"),
        (lambda: replace(SCENE, sample_distance=0.0), "0.01 to 10"),
        (lambda: Scene.of(make_volume(), 16, movable_light=True), "no light to move"),
        *((lambda data=data: Scene.from_json(data), "malformed")
          for data in (None, [], {"volume_name": "x"}, "scene")),
        (lambda: ViewRange(up="z"), "not an axis"),
        (lambda: view_in("up", 0.0, 0.0), r"'up' is not an axis; give one of \+x"),
        (lambda: standard_view("Inside", View(), "+z"), "'Inside' is not a view"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(build, message):
    with pytest.raises(TfscopeError, match=message):
        build()


def test_a_scene_takes_the_up_axis_and_a_window_from_its_volume():
    lying = replace(make_volume(), up="-y")
    assert Scene.of(lying, 16).view_range.up == "-y"
    assert Scene.of(lying, 16, up="+x").view_range.up == "+x"
    assert SCENE.view_range.up == "+z"
    lo, hi = SCENE.scalar_window
    assert 100 < lo < hi < 200


WINDOWED = Scene.of(make_volume(), image_size=16, scalar_window=(120.0, 180.0))


@pytest.mark.parametrize(("view", "modes", "said"), [
    (View(azimuth=300.0, elevation=80.0, roll=-10.0, distance=0.4), (120.0, 180.0), ()),
    (View(elevation=-85.0), (130.0, 170.0), ("elevation -85°",)),
    (View(roll=11.0), (130.0, 170.0), ("roll 11°",)),
    (View(distance=0.3), (130.0, 170.0), ("distance 0.30",)),
    (View(distance=1.2), (130.0, 170.0), ("distance 1.20",)),
    (View(), (110.0, 190.0, 150.0), ("2 modes",)),
    (View(elevation=90.0, roll=20.0), (100.0,), ("elevation", "roll", "a mode")),
])  # fmt: skip
def test_what_lies_outside_is_named_in_one_line(view, modes, said):
    opacity, color = make_tf(*modes).opacity, make_tf().color
    text = outside_range(SceneInputs(view, opacity, color), WINDOWED)
    assert all(part in text for part in said) and "\n" not in text
    assert text.count(",") == max(len(said) - 1, 0) and bool(text) == bool(said)


def test_a_free_curve_is_named():
    opacity = OpacityTF((100.0, 200.0), points=((100.0, 0.0), (200.0, 1.0)))
    scene = replace(WINDOWED, tf_family="paper")
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


def test_a_view_that_is_upside_down_is_reported_with_the_axis():
    scene = Scene.of(make_volume(), 16, up="-z")
    text = outside_range(SceneInputs.of(View(30, 20), make_tf()), scene)
    assert "roll 180° (±10° with −z up)" in text.replace("roll -180", "roll 180")


def test_known_colours():
    # CIELAB of sRGB red under D65, from the standard's formulas: L 53.24, a 80.09, b 67.20.
    red = rgb_to_lab(np.array([1.0, 0.0, 0.0], np.float32))
    expected = 53.24 / 50, 2 * (80.09 + 86.185) / 184.439, 2 * (67.20 + 107.863) / 202.345
    np.testing.assert_allclose(red + 1, expected, atol=1e-3)
    # Those outside the cube are clipped, not NaN.
    wild = np.array([[-3.0, 0.5, 7.0], [1.001, -1e-9, 0.2]], np.float32)
    np.testing.assert_array_equal(rgb_to_lab(wild), rgb_to_lab(np.clip(wild, 0, 1)))
    assert np.isfinite(rgb_to_lab(wild)).all()


def test_a_rectangle_has_its_pixels():
    mask = Region(2, 1, 5, 3).mask(8)
    assert np.argwhere(mask).tolist() == [[r, c] for r in (1, 2) for c in (2, 3, 4)]
    np.testing.assert_array_equal(Outline.rectangle(2 / 8, 1 / 8, 5 / 8, 3 / 8).mask(8), mask)
    assert Region.whole(4).mask(4).all() and Outline().mask(4).all()
    # Smaller than a pixel is that pixel, and partly outside is what is inside.
    for x, y in ((0.01, 0.01), (0.52, 0.31), (0.999, 0.999)):
        mask = Outline.rectangle(x - 1e-4, y - 1e-4, x + 1e-4, y + 1e-4).mask(16)
        assert np.argwhere(mask).tolist() == [[int(y * 16), int(x * 16)]]
    mask = Outline.rectangle(-0.5, -0.5, 0.25, 0.25).mask(8)
    assert np.argwhere(mask).max() == 1 and mask.sum() == 4
    with pytest.raises(RenderError, match="outside the image"):
        Outline.rectangle(1.2, 0.1, 1.5, 0.4).mask(8)


def test_a_lasso_has_the_pixels_whose_centres_are_inside():
    angles = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    points = zip(0.5 + 0.3 * np.cos(angles), 0.4 + 0.3 * np.sin(angles), strict=True)
    circle = Outline(tuple(points))
    y, x = (np.mgrid[:64, :64] + 0.5) / 64
    expected = (x - 0.5) ** 2 + (y - 0.4) ** 2 < 0.3**2
    assert (circle.mask(64) != expected).mean() < 0.01
    assert circle.moved(0.1, 0.2).mask(64)[38, 38]


def test_an_outline_refers_to_the_square_in_the_middle_of_a_wider_image():
    square = Outline.rectangle(0.25, 0.5, 0.5, 1.0)
    wide, high = square.mask((8, 20)), square.mask((20, 8))
    np.testing.assert_array_equal(wide[:, 6:14], square.mask(8))
    np.testing.assert_array_equal(high[6:14], square.mask(8))
    assert wide.sum() == high.sum() == square.mask(8).sum()
    beside = Outline.rectangle(1.25, 0.0, 3.0, 0.5)
    pixels = [[row, column] for row in range(4) for column in range(16, 20)]
    assert np.argwhere(beside.mask((8, 20))).tolist() == pixels
    assert Outline().mask((8, 20)).all() and Region(15, 0, 20, 8).mask((8, 20)).sum() == 40
    assert square.is_in_square and not beside.is_in_square


@given(st.integers(1, 12), st.data())
def test_windows_cover_a_mask_once(size, data):
    bits = data.draw(st.lists(st.booleans(), min_size=size * size, max_size=size * size))
    mask = np.array(bits).reshape(size, size)
    found = np.zeros((size, size), int)
    for top, bottom, left, right in windows_of(mask):
        found[top:bottom, left:right] += 1
    np.testing.assert_array_equal(found, mask)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0, 1.5))
def test_an_outline_can_be_kept_inside(x, y, side):
    outline = Outline.rectangle(x, y, x + side, y + side)
    kept = outline.kept_inside()
    for size in (1, 7, 64):
        assert kept.mask(size).any()
    assert outline.kept_inside((1.25, 0.5)).mask((8, 20)).any()
    if x >= 0 and x + side <= 1 and y >= 0 and y + side <= 1 and min(x, y) < 0.9 and side > 0.1:
        assert kept == outline


def test_a_plane_moves_alone_and_stops_before_its_opposite():
    box = CropBox((0.1, 0.2, 0.3), (0.9, 0.8, 0.7))
    assert box.with_plane(1, 0, 0.5) == CropBox((0.1, 0.5, 0.3), (0.9, 0.8, 0.7))
    assert box.with_plane(2, 1, 1.7).high == (0.9, 0.8, 1.0)
    assert box.with_plane(0, 0, -3.0).low == (0.0, 0.2, 0.3)
    assert box.with_plane(0, 0, 0.95, least=0.25).low[0] == pytest.approx(0.65)
    assert box.with_plane(0, 1, 0.0, least=0.25).high[0] == pytest.approx(0.35)
    # A box shorter than the length to keep stays in the volume.
    for side, high in ((0, 0.1), (1, 0.5)):
        thin = CropBox((0.0, 0.0, 0.0), (1.0, 0.1, 1.0))
        thin = thin.with_plane(1, side, 1.0 - side, least=0.5)
        assert (thin.low[1], thin.high[1]) == pytest.approx((0.0, high))
