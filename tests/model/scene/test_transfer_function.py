import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.errors import TransferFunctionError
from model.scene.tf_presets import COLOR_MAPS, color_tf_of_map, map_colors, reversed_colors
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction

GREY = ColorTF((0.0, 1.0), ((0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0)))


def test_modes_follow_the_formula():
    tf = OpacityTF((0.0, 100.0), (GaussianMode(40.0, 5.0, 0.6), GaussianMode(45.0, 10.0, 0.3)))
    s = 47.0
    expected = 0.6 * np.exp(-((7 / 5) ** 2)) + 0.3 * np.exp(-((2 / 10) ** 2))
    assert tf(s) == pytest.approx(expected)
    # Those that overlap stop at one.
    assert OpacityTF((0.0, 1.0), (GaussianMode(0.5, 0.2, 0.9),) * 2)(0.5) == 1.0


@given(st.floats(1e-12, 10.0), st.floats(0, 1), st.floats(-5, 5))
def test_no_mode_is_drawn_narrower_than_a_bin(width, amplitude, mean):
    tf = OpacityTF((-1.0, 1.0), (GaussianMode(mean, width, amplitude),))
    assert tf.modes[0].width == width
    sampled = tf.sample()
    if width <= 2.0 / 256:
        as_wide = OpacityTF((-1.0, 1.0), (GaussianMode(mean, 2.0 / 256, amplitude),))
        np.testing.assert_array_equal(sampled, as_wide.sample())
    assert np.isfinite(sampled).all()
    assert sampled.min() >= 0 and sampled.max() <= 1
    if -1 <= mean <= 1 and amplitude > 0:
        # The nearest sample is at most half a step of 2 / 255 away from the peak.
        assert sampled.max() >= 0.75 * amplitude


def test_samples_include_both_ends():
    tf = OpacityTF((10.0, 20.0), points=((10.0, 0.25), (20.0, 0.75)))
    sampled = tf.sample()
    assert sampled.dtype == np.float32
    assert (sampled[0], sampled[-1]) == (0.25, 0.75)
    np.testing.assert_allclose(tf.sample((10.0, 15.0), 3), [0.25, 0.375, 0.5])
    # A curve is constant outside its points.
    tf = OpacityTF((0.0, 10.0), points=((2.0, 0.1), (4.0, 0.5), (4.0, 0.9), (6.0, 0.2)))
    np.testing.assert_allclose(tf([0.0, 3.0, 5.0, 9.0]), [0.1, 0.3, 0.55, 0.2])


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: GaussianMode(0.0, 0.0, 0.5), "width"),
        (lambda: GaussianMode(0.0, float("nan"), 0.5), "width"),
        (lambda: GaussianMode(float("inf"), 1.0, 0.5), "mean"),
        (lambda: GaussianMode(0.0, 1.0, 1.5), "amplitude"),
        (lambda: OpacityTF((1.0, 1.0)), "not increasing"),
        (lambda: OpacityTF((0.0, 1.0), points=((0.5, 0.0), (0.1, 1.0))), "sorted"),
        (lambda: OpacityTF((0.0, 1.0), points=((0.5, -0.1),)), "outside 0 to 1"),
        (lambda: OpacityTF((0.0, 1.0), (GaussianMode(0, 1, 1),), ((0.0, 0.0),)), "either"),
        (lambda: ColorTF((0.0, 1.0), ()), "at least one stop"),
        (lambda: ColorTF((0.0, 1.0), ((0.0, 2.0, 0.0, 0.0),)), "outside 0 to 1"),
    ],
)
def test_invalid_functions_get_one_sentence(build, message):
    with pytest.raises(TransferFunctionError, match=message):
        build()


finite = st.floats(-1e6, 1e6)
unit = st.floats(0, 1)


@st.composite
def transfer_functions(draw):
    lo = draw(finite)
    hi = lo + draw(st.floats(1e-3, 1e6))
    color = ColorTF(
        (lo, hi),
        tuple(
            (v, *draw(st.tuples(unit, unit, unit)))
            for v in sorted(draw(st.lists(finite, min_size=1, max_size=5)))
        ),
    )
    if draw(st.booleans()):
        modes = st.builds(GaussianMode, finite, st.floats(1e-6, 1e6), unit)
        return TransferFunction(
            OpacityTF((lo, hi), tuple(draw(st.lists(modes, max_size=4)))), color
        )
    values = sorted(draw(st.lists(finite, min_size=1, max_size=5)))
    points = tuple((v, draw(unit)) for v in values)
    return TransferFunction(OpacityTF((lo, hi), points=points), color)


@given(transfer_functions())
def test_files_keep_every_number(tf):
    assert TransferFunction.from_json(json.loads(json.dumps(tf.to_json()))) == tf


def test_the_file_is_as_documented(tmp_path):
    tf = TransferFunction(OpacityTF((0.0, 1.0), (GaussianMode(0.3, 0.1, 0.5),)), GREY)
    tf.save(tmp_path / "tf.json")
    assert json.loads((tmp_path / "tf.json").read_text()) == {
        "tfscope_tf": 1,
        "range": [0.0, 1.0],
        "opacity": {"modes": [{"mean": 0.3, "width": 0.1, "amplitude": 0.5}]},
        "color": {"stops": [[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]]},
    }
    assert TransferFunction.load(tmp_path / "tf.json") == tf


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "not valid JSON"),
        ("[1, 2]", "not a tfscope TF"),
        ('{"tfscope_tf": 9}', "version is 9"),
        ('{"tfscope_tf": 1}', "malformed near 'opacity'"),
        ('{"tfscope_tf": 1, "range": [0, 1], "opacity": {"modes": [3]}, "color": 0}', "malformed"),
        (
            '{"tfscope_tf": 1, "range": [1, 0], "opacity": {}, "color": {"stops": [[0, 0, 0, 0]]}}',
            "not increasing",
        ),
        ("\xff\xfe", "not valid JSON"),
    ],
)
def test_bad_files_get_one_sentence(tmp_path, content, message):
    path = tmp_path / "tf.json"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(TransferFunctionError, match=message) as caught:
        TransferFunction.load(path)
    assert str(path) in str(caught.value)


def test_without_a_range_values_are_fractions():
    content = {
        "tfscope_tf": 1,
        "opacity": {"points": [[0.25, 0.0], [0.75, 1.0]]},
        "color": {"stops": [[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]]},
    }
    tf = TransferFunction.from_json(content)
    assert tf.is_relative and tf.scalar_range == (0.0, 1.0)
    assert tf.to_json() == content
    # With a range, [0, 1] is one like others.
    assert not TransferFunction.from_json(content | {"range": [0, 1]}).is_relative


def test_values_that_are_no_fractions_need_a_range():
    tf = {"tfscope_tf": 1, "opacity": {"modes": []}, "color": {"stops": [[40, 0, 0, 0]]}}
    with pytest.raises(TransferFunctionError, match="40 is no fraction"):
        TransferFunction.from_json(tf)
    assert TransferFunction.from_json(tf | {"range": [0, 100]}).color.stops[0][0] == 40


def test_a_missing_file_and_an_unwritable_place_are_said(tmp_path):
    tf = TransferFunction(OpacityTF((0.0, 1.0)), GREY)
    with pytest.raises(TransferFunctionError, match="cannot be read"):
        TransferFunction.load(tmp_path / "none.json")
    with pytest.raises(TransferFunctionError, match="cannot be written"):
        tf.save(tmp_path / "no" / "such" / "folder.json")


@pytest.mark.parametrize("name", COLOR_MAPS)
def test_a_color_tf_is_near_its_map_everywhere(name):
    color = color_tf_of_map(name, (-5.0, 12.0))
    assert len(color.stops) == 9
    assert (color.stops[0][0], color.stops[-1][0]) == (-5.0, 12.0)
    np.testing.assert_allclose(color.sample(count=101), map_colors(name, 101), atol=0.08)


def test_reversing_mirrors_and_twice_changes_nothing():
    color = color_tf_of_map("Batlow", (1e9, 1e9 + 1))
    mirrored = reversed_colors(color)
    np.testing.assert_allclose(mirrored.sample(), color.sample()[::-1], atol=1e-6)
    assert reversed_colors(mirrored) == color
