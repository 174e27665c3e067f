from dataclasses import replace

import numpy as np
import pytest
from ramp import make_tf, make_volume

from model.scene.crop import CropBox
from model.scene.hints import narrow_part, nothing_visible, why_nothing
from model.scene.inputs import SceneInputs
from model.scene.ranges import opacity_over
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View

WIDE = (0.0, 65535.0)


def band(low, high, scalar_range=WIDE):
    lo, hi = scalar_range
    points = ((lo, 0.0), (low, 0.0), ((low + high) / 2, 0.9), (high, 0.0), (hi, 0.0))
    return OpacityTF(scalar_range, points=points)


def slot(low, high):
    corners = ((low, 0.9), (low, 0.0), (high, 0.0), (high, 0.9))
    return OpacityTF(WIDE, points=((0.0, 0.9), *corners, (65535.0, 0.9)))


def mode(mean, width, *more):
    return OpacityTF(WIDE, (GaussianMode(mean, width, 0.9), *more))


NARROW = {
    "a band of a curve": band(29977.0, 30023.0),
    "a band between two entries": band(30000.0, 30046.0),
    "a slot": slot(29977.0, 30023.0),
    "a mode": mode(30000.0, 10.0),
    "a mode beside a wide one": mode(30000.0, 10.0, GaussianMode(9000.0, 3000.0, 0.9)),
    "two modes": mode(30000.0, 10.0, GaussianMode(30100.0, 12.0, 0.9)),
    "two modes far apart": mode(30000.0, 10.0, GaussianMode(60000.0, 12.0, 0.9)),
}


def error(opacity, scalar_range, around):
    """Mean error of tables over a range, of what they are read as between their entries."""
    shown = opacity_over(opacity, scalar_range)
    values = np.linspace(*around, 4001)
    read = np.interp(values, np.linspace(*scalar_range, 256), shown.sample())
    exact = OpacityTF(around, opacity.modes, opacity.points)(values)
    return float(np.abs(read - exact).mean())


@pytest.mark.parametrize("opacity", NARROW.values(), ids=NARROW)
def test_the_remedy_shows_it_as_it_is(opacity):
    found = narrow_part(opacity)
    (low, high), (first, last) = found.values, found.remedy
    assert WIDE[0] <= first <= low < high <= last <= WIDE[1]
    around = low - 20, high + 20
    assert error(opacity, WIDE, around) > 0.15
    assert error(opacity, found.remedy, around) < 0.02
    assert narrow_part(opacity_over(opacity, found.remedy)) is None


def test_the_sentence_names_both_and_the_remedy_has_enough_digits():
    found = narrow_part(band(29977.0, 30023.0))
    assert "29,977 to 30,023" in found.sentence and "0 to 65,535" in found.sentence
    assert found.remedy_text == "29,905 to 30,095"
    assert narrow_part(band(0.5, 0.502, (0.0, 1.0))).remedy_text == ".4970 to .5050"


@pytest.mark.parametrize(
    "opacity",
    [
        OpacityTF(WIDE),
        mode(30000.0, 260.0),
        # Outside of the range, or hardly there, it does not matter.
        OpacityTF((0.0, 20000.0), (GaussianMode(30000.0, 10.0, 0.9),)),
        mode(30000.0, 3000.0, GaussianMode(9000.0, 10.0, 0.01)),
        band(29700.0, 30300.0),
        # Steps and steep slopes, up or down, and a sawtooth.
        OpacityTF(WIDE, points=((0.0, 0.0), (3e4, 0.0), (3e4, 0.8), (65535.0, 0.8))),
        OpacityTF(WIDE, points=((0.0, 0.8), (3e4, 0.8), (30010.0, 0.0), (65535.0, 0.0))),
        OpacityTF(WIDE, points=((0.0, 0.0), (27e3, 0.0), (3e4, 0.9), (3e4, 0.0), (65535.0, 0.0))),
        OpacityTF(WIDE, points=((0.0, 0.5),)),
        OpacityTF(WIDE, points=((0.0, 0.0), (65535.0, 0.0))),
    ],
)
def test_what_is_drawn_about_as_it_is(opacity):
    assert narrow_part(opacity) is None


def test_a_narrow_colour_counts_where_it_is_seen():
    grey, red = (0.5, 0.5, 0.5), (1.0, 0.1, 0.1)
    band = ((29977.0, *grey), (30000.0, *red), (30023.0, *grey))
    color = ColorTF(WIDE, ((0.0, *grey), *band, (65535.0, *grey)))
    opaque = mode(30000.0, 9000.0)
    found = narrow_part(opaque, color)
    assert found.values == pytest.approx((29977, 30023), abs=2)
    low, high = found.remedy
    read = np.interp(30000.0, np.linspace(low, high, 256), color.sample((low, high))[:, 0])
    assert read == pytest.approx(1.0, abs=0.02)
    assert narrow_part(mode(10000.0, 3000.0), color) is None
    # A step of a colour is drawn as a slope, as one of the opacity is.
    step = ((0.0, *grey), (30000.0, *grey), (30000.0, *red), (65535.0, *red))
    assert narrow_part(opaque, ColorTF(WIDE, step)) is None


SHOWN = SceneInputs.of(View(), make_tf(150.0))


def explain(inputs, aspect=1.0):
    """Explain an image of a volume with the values 100 to 120 and 180 to 200."""
    volume = make_volume()
    counts, edges = volume.histogram(64)
    middle = (edges[:-1] + edges[1:]) / 2
    counts[(middle > 120) & (middle < 180)] = 0
    return why_nothing(inputs, volume.scalar_range, counts, edges, aspect)


def with_mode(mean, scalar_range=(100.0, 200.0)):
    opacity = OpacityTF(scalar_range, (GaussianMode(mean, 5.0, 0.8),))
    color = ColorTF(scalar_range, ((mean, 1.0, 1.0, 1.0),))
    return SceneInputs(View(), opacity, color)


@pytest.mark.parametrize(("level", "nothing"), [(0.0, True), (0.005, True), (0.007, False)])
def test_one_pixel_that_is_seen_is_not_nothing(level, nothing):
    rgba = np.zeros((8, 9, 4), np.float32)
    rgba[3, 4, 3] = level
    rgba[0, 0] = (1.0, 1.0, 1.0, np.nan)
    assert nothing_visible(rgba) is nothing


@pytest.mark.parametrize(
    ("inputs", "said"),
    [
        (replace(SHOWN, opacity_tf=OpacityTF((100.0, 200.0))), "transparent at every scalar value"),
        # 5 sqrt(ln 100) = 10.7 on either side of the mode
        (with_mode(150.0), "from 139.6 to 160.4, which no voxel has"),
        (with_mode(330.0, (100.0, 400.0)), "lie between 100 and 200"),
    ],
)
def test_a_tf_that_shows_nothing(inputs, said):
    found = explain(inputs)
    assert found.cause == "tf" and said in found.text


def test_values_that_hardly_any_voxel_has():
    edges = np.linspace(0, 10, 11)
    counts = np.array([10**6, 0, 0, 0, 0, 0, 0, 0, 0, 3])
    inputs = replace(SHOWN, opacity_tf=OpacityTF((0, 10), points=((9, 0.0), (10, 1.0))))
    found = why_nothing(inputs, (0.0, 10.0), counts, edges)
    assert "3 voxels of 1,000,003" in found.text


@pytest.mark.parametrize(
    ("view", "aspect", "outside"),
    [
        (View(pan_x=2.1), 1.0, True), (View(pan_x=2.1), 1.5, False), (View(pan_y=-2.1), 1.5, True),
        (View(pan_y=1.9), 1.0, False), (View(distance=200.0), 1.0, True),
        (View(distance=0.2, pan_x=9.0), 1.0, False),
    ],
)  # fmt: skip
def test_a_view_that_misses_the_volume(view, aspect, outside):
    found = explain(replace(with_mode(190.0), view=view), aspect)
    assert ("left the image" in found.text or "too small" in found.text) is outside
    if outside:
        assert found.cause == "view"


def test_a_crop_box_is_named_when_the_rest_is_in_order():
    crop = CropBox((0.0, 0.0, 0.0), (0.1, 0.1, 0.1))
    assert explain(replace(with_mode(190.0), crop=crop)).cause == "crop"
    assert explain(replace(with_mode(190.0), crop=CropBox())).cause == "tf"
    assert explain(replace(with_mode(190.0), view=View(distance=0.3))).cause == "view"
