import colorsys
import itertools
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.errors import TransferFunctionError
from model.scene import tf_presets
from model.scene.default_tf import default_transfer_function, is_smoke
from model.scene.scene import default_scalar_window, window_above_background
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.volume import Volume

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


@pytest.mark.parametrize(("build", "message"), [
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
])  # fmt: skip
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
        drawn = tuple(draw(st.lists(modes, max_size=4)))
        return TransferFunction(OpacityTF((lo, hi), drawn), color)
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


@pytest.mark.parametrize("name", tf_presets.COLOR_MAPS)
def test_a_color_tf_is_near_its_map_everywhere(name):
    color = tf_presets.color_tf_of_map(name, (-5.0, 12.0))
    assert len(color.stops) == 9
    assert (color.stops[0][0], color.stops[-1][0]) == (-5.0, 12.0)
    np.testing.assert_allclose(color.sample(count=101), tf_presets.map_colors(name, 101), atol=0.08)


def ct(rng, scale=1.0, shift=0.0):
    """Voxels of air, fat, muscle and bone in HU, on another scale if wished."""
    parts = ((-1000, 5, 60000), (-90, 20, 8000), (40, 20, 20000), (700, 250, 3000))
    values = [rng.normal(mean, width, count) for mean, width, count in parts]
    return np.clip(np.concatenate(values), -1000, 1500) * scale + shift


def named(values, units=""):
    counts, edges = np.histogram(values, bins=256)
    lo, hi = float(edges[0]), float(edges[-1])
    return {p.name: p.tf for p in tf_presets.presets((lo, hi), counts, edges, units)}


def test_those_of_ct_show_what_their_names_say():
    assert tf_presets.looks_like_hu((-1000.0, 3000.0))
    assert not tf_presets.looks_like_hu((0.0, 4095.0))
    found = named(ct(np.random.default_rng(0)))
    bone, skin, vessels = (found[name].opacity for name in ("Bone white", "Skin", "Vessels"))
    air, muscle, contrast, dense = -1000.0, 40.0, 300.0, 900.0
    assert bone([air, muscle]).max() == 0
    assert bone(dense) > 0.4
    assert skin(air) == 0
    assert skin(muscle) > 0.4
    assert vessels([air, muscle]).max() == 0
    assert vessels(contrast) > vessels(600.0)
    red, green, blue = found["Vessels"].color(contrast)
    assert red > 2 * green > 2 * blue / 1.5


def test_dense_parts_are_grains_in_a_haze():
    rng = np.random.default_rng(2)
    # A paste without any air, and one voxel in 300 of something denser, as in cement.
    values = np.concatenate([rng.normal(100, 12, 100_000), rng.normal(190, 8, 330)])
    opacity = named(values)["Dense parts"].opacity
    assert opacity(190.0) > 0.5
    assert opacity(np.quantile(values, [0.5, 0.9, 0.99])).max() < 0.05
    assert opacity(np.quantile(values, 0.97)) > 0


def test_a_ct_on_another_scale_has_the_same_presets():
    # As stored with 8 bits: -1000 to 1500 HU on 0 to 255.
    scale, shift = 255 / 2500, 1000 * 255 / 2500
    own = named(ct(np.random.default_rng(0)))
    other = named(ct(np.random.default_rng(0), scale, shift))
    for name in ("Bone white", "Skin"):
        for value in (-1000.0, 40.0, 900.0):
            expected = own[name].opacity(value)
            assert other[name].opacity(value * scale + shift) == pytest.approx(expected, abs=0.1)


def test_bone_without_soft_tissue_is_opaque():
    rng = np.random.default_rng(3)
    # A micro-CT of bone whose values fill 8 bits.
    values = np.concatenate([rng.normal(14, 4, 60_000), rng.normal(235, 8, 30_000)])
    bone = named(values.clip(0, 255))["Bone white"].opacity
    assert bone(235.0) > 0.5
    assert bone([14.0, 80.0]).max() == 0


def test_all_span_the_range_asked_for_and_differ():
    values = ct(np.random.default_rng(1))
    counts, edges = np.histogram(values, bins=256)
    for scalar_range in ((-1000.0, 1500.0), (0.0, 300.0), (-5000.0, 9000.0)):
        found = [p.tf for p in tf_presets.presets(scalar_range, counts, edges)]
        assert len(found) == 7
        assert {tf.scalar_range for tf in found} == {scalar_range}
        assert {(tf.color.stops[0][0], tf.color.stops[-1][0]) for tf in found} == {scalar_range}
    found = list(named(values).values())
    for one, other in itertools.combinations(found, 2):
        assert np.abs(one.opacity.sample() - other.opacity.sample()).max() > 0.05


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


@pytest.mark.parametrize(
    ("air", "foot"),
    # Noise of air, air alone, levels with gaps, and air that is not lower than the window.
    [(range(20), 22), ([0], 3), ([0, 0, 0, 7], 3), ([120], 64)],
)
def test_the_maps_window_begins_above_the_background(air, foot):
    counts = np.ones(256, int)
    np.add.at(counts, np.array(air), 10_000)
    counts[200] = 10**6  # a frequent material
    edges, window = np.arange(257.0), (64.0, 224.0)
    assert window_above_background(counts, edges, (0.0, 256.0), window) == (foot, 224)


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
    modes = default_transfer_function(uniform(lo, hi)).opacity.modes
    places = [(mode.mean - lo) / (hi - lo) for mode in modes]
    unit = [m.mean for m in default_transfer_function(uniform(0.0, 1.0)).opacity.modes]
    assert places == pytest.approx(unit, abs=0.01)


def test_what_has_the_highest_values_is_shown_where_it_is_large():
    random = np.random.default_rng(0)
    values = random.uniform(0, 200, (48, 48, 48))
    values[..., :5] = random.uniform(200, 255, (48, 48, 5))
    opacity = default_transfer_function(Volume(values)).opacity
    assert opacity(245.0) > opacity.modes[-1].amplitude / 4


def test_smoke_stays_translucent_and_a_body_of_the_same_size_does_not():
    radius = np.linalg.norm(np.indices((48, 48, 48)) - 23.5, axis=0)
    puff = np.exp(-((radius / 8) ** 2))
    body = np.where(radius < 14, 0.6, 0.0) + np.random.default_rng(0).normal(0, 0.02, radius.shape)
    rays = {}
    for smoke, values in ((True, puff), (False, body)):
        thinned = ThinnedVolume.of(Volume(values))
        assert is_smoke(thinned) == smoke
        opacity = default_transfer_function(Volume(values)).opacity
        found = 1 - np.prod(1 - opacity(values), axis=2)
        rays[smoke] = np.median(found[(radius < 12).any(axis=2)])
    assert rays[False] >= 0.9 > rays[True] > 0.3


@pytest.mark.parametrize("grains", [190.0, 30.0])
def test_grains_are_shown_without_the_resin_about_them(grains):
    random = np.random.default_rng(0)
    values = random.normal(110, 6, (48, 48, 48))
    values[20:28, 10:20, 30:36] = random.normal(grains, 6, (8, 10, 6))
    opacity = default_transfer_function(Volume(values)).opacity
    assert opacity(110.0) < 0.01
    assert opacity(grains + np.arange(-6, 7)).max() > 0.3


@pytest.mark.parametrize("of_patient", [True, False])
def test_the_best_for_the_kind_of_data_come_first_whatever_range_is_shown(of_patient):
    values = ct(np.random.default_rng(0))
    first = "Bone white" if of_patient else "Opaque surface"
    for lo, hi in ((-1000.0, 1500.0), (0.0, 300.0)):
        counts, edges = np.histogram(values, bins=256, range=(lo, hi))
        listed = tf_presets.presets((lo, hi), counts, edges, of_patient=of_patient)
        assert listed[0].name == first and len(listed) == 7
