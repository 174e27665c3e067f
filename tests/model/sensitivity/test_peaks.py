from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from test_exact import RANGE, SIZE, VIEW, small_volume, tf_of

from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.tf_perturbation import edit_around
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.sensitivity import display, peaks
from model.sensitivity.exact import change_norms, visibility
from model.sensitivity.what_if import compare

BINS = np.arange(256)


def bump(center, width, height):
    return height * np.exp(-((BINS - center) ** 2) / (2 * width**2))


def test_the_strongest_peaks_come_first():
    curve = bump(40, 6, 0.2) - bump(120, 8, 0.5) + bump(200, 5, 0.1) + bump(240, 3, 0.05)
    found = peaks.strongest_intervals(curve, (0.0, 510.0))
    assert [round(i.value) for i in found] == [240, 80, 400]
    assert found[0].response == pytest.approx(-0.5, abs=1e-3)
    # Half as high at 1.18 standard deviations: 2 units a bin.
    assert found[0].high - found[0].low == pytest.approx(2 * 2.355 * 8, rel=0.05)
    assert found[1].predicted(0.3) == pytest.approx(6.0, rel=1e-3)


def test_a_response_that_rises_to_an_end_is_a_peak():
    (found,) = peaks.strongest_intervals(np.linspace(0, 1, 256), (0.0, 255.0))
    assert (found.value, found.high) == (255.0, 255.0)


@pytest.mark.parametrize("curve", [np.zeros(256), np.full(256, np.nan), np.full(256, 1e-9)])
def test_where_nothing_responds_there_is_no_interval(curve):
    assert peaks.strongest_intervals(curve, (0.0, 1.0)) == ()


def test_the_prediction_is_what_a_faint_mode_does():
    renderer = RaycastRenderer(small_volume())
    before = SceneInputs.of(VIEW, tf_of(bump(180, 20, 0.2)))
    width = 6.0
    norms = change_norms(renderer, before, SIZE, Region.whole(SIZE), width)
    best = peaks.strongest_intervals(display.shown_responses(norms, SIZE**2, width), RANGE)[0]
    height = 1e-3
    mode = OpacityTF(RANGE, (GaussianMode(best.value, np.sqrt(2) * width, height),))
    opacity = before.opacity_tf.sample(RANGE) + mode.sample(RANGE)
    after = SceneInputs.of(VIEW, tf_of(opacity))
    images = [renderer.render(i, SIZE)[..., :3].astype(float) for i in (before, after)]
    rmse = np.sqrt(np.mean((images[1] - images[0]) ** 2))
    assert best.predicted(height) == pytest.approx(rmse, rel=0.1)


def test_a_place_shows_the_value_that_is_there():
    renderer = RaycastRenderer(small_volume())
    for center in (90, 200):
        inputs = SceneInputs.of(VIEW, tf_of(bump(center, 6, 0.4)))
        seen = visibility(renderer, inputs, SIZE, Region.whole(SIZE))
        found = peaks.contributions(seen, RANGE)
        assert abs(found[0].value - center) < 12
        assert found[0].share > 0.9
    both = peaks.contributions(bump(60, 5, 1.0) + bump(160, 5, 3.0), RANGE)
    assert [round(c.value) for c in both] == [160, 60]
    assert [c.share for c in both] == pytest.approx([0.75, 0.25], abs=0.01)
    assert peaks.contributions(np.zeros(256), RANGE) == ()


def test_a_long_flank_is_named_beside_the_peak_that_it_leads_to():
    # It only rises: there is one peak.
    haze = np.interp(np.arange(256), (60, 200, 240), (0.1, 0.2, 0.2), left=0.0)
    found = peaks.contributions(haze + bump(225, 6, 3.0), RANGE)
    surface, flank = found
    assert surface.value == pytest.approx(225, abs=4) and 110 < flank.value < 170
    assert surface.share + flank.share == pytest.approx(1.0)
    # Haze of another material, far away, does not stretch the peak's range.
    (found,) = peaks.contributions(0.004 * bump(60, 30, 1.0) + bump(225, 6, 1.0), RANGE)
    assert found.reach[0] > 205
    # The tails of a mode are its own.
    assert len(peaks.contributions(bump(120, 12, 1.0), RANGE)) == 1


def test_values_stay_in_their_rows_while_they_are_edited():
    gone = partial(replace, share=0.0)
    before = peaks.contributions(bump(60, 5, 1.0) + bump(160, 5, 3.0), RANGE)
    # The first one is lowered below the second, which moves a little; a third one appears.
    after = peaks.contributions(bump(62, 5, 3.0) + bump(160, 5, 1.0) + bump(220, 5, 5.0), RANGE)
    assert [round(c.value) for c in after] == [220, 62, 160]
    listed = peaks.follow(before, after, RANGE, gone)
    assert [round(c.value) for c in listed] == [160, 62, 220]
    assert sum(c.share for c in listed) == pytest.approx(1.0)
    # What no longer shows keeps its row.
    missing = peaks.follow(before, peaks.contributions(bump(60, 5, 1.0), RANGE), RANGE, gone)
    assert [(round(c.value), round(c.share, 2)) for c in missing] == [(160, 0.0), (60, 1.0)]
    assert peaks.follow((), after, RANGE, gone) == after
    # An edit within a broad peak's reach may show more of its flank.
    (broad,) = peaks.contributions(bump(120, 12, 1.0), RANGE)
    within = peaks.contributions(bump(106, 5, 1.0), RANGE)
    assert abs(within[0].value - broad.value) > peaks.SAME
    assert peaks.follow((broad,), within, RANGE, gone) == within


def test_what_goes_on_rising_outside_the_window_is_no_peak_inside():
    curve = bump(10, 12, 5.0) + bump(130, 8, 0.1)
    (found,) = peaks.strongest_intervals(curve, (0.0, 255.0), window=(32.0, 223.0))
    assert found.value == 130.0
    (found,) = peaks.strongest_intervals(np.linspace(0, 1, 256), (0.0, 255.0), window=(32.0, 255.0))
    assert found.value == 255.0
    assert peaks.strongest_intervals(curve, (0.0, 255.0), window=(30.2, 30.8)) == ()


def test_a_darkening_edit_has_a_negative_brightness():
    before = np.full((4, 4, 3), 0.5, np.float32)
    after = before.copy()
    after[:2] = 0.3
    top = np.zeros((4, 4), bool)
    top[:2] = True
    found = compare(before, after, top)
    assert found.rmse == pytest.approx(0.2)
    assert compare(before, after, ~top).rmse == 0


def listed(*shares):
    return [peaks.Contribution(0.0, share, (0.0, 0.0)) for share in shares]


def test_the_one_that_was_rounded_up_most_gives_way():
    assert peaks.percentages(listed(0.436, 0.287, 0.277)) == (43, 29, 28)
    assert peaks.percentages(listed(0.75, 0.25)) == (75, 25)
    assert peaks.percentages(()) == ()


def test_a_value_between_two_samples_is_interpolated():
    field = np.arange(256, dtype=np.float32) * np.ones((2, 3, 1), np.float32)
    # 256 samples from 10 to 265: one per unit.
    for value in (10.0, 77.25, 265.0):
        found = display.field_of_value(field, value, (10.0, 265.0))
        assert found.shape == (2, 3)
        np.testing.assert_allclose(found, value - 10.0, rtol=1e-5)


def test_the_unit_is_an_edit_that_adds_a_hundredth_at_its_peak():
    edit = edit_around(128.0, (0.0, 255.0), 6.0)
    assert display.per_small_edit(edit) * edit.max() == pytest.approx(0.01)
    # A picture whose every number changes by 2 per unit of the edit.
    changes = np.full((8, 8, 3), 2.0, np.float32)
    expected = 2.0 * display.per_small_edit(edit)
    np.testing.assert_allclose(display.shown_field(changes, edit, "change"), expected)
    np.testing.assert_allclose(display.shown_field(-changes, edit, "signed"), -expected)
    norm = np.full(256, np.linalg.norm(changes))
    np.testing.assert_allclose(display.shown_responses(norm, 64, 6.0), expected, rtol=1e-5)


def test_what_brightens_one_colour_and_darkens_another_is_a_change():
    changes = np.array([[[1.0, -1.0, 0.0]]])
    edit = np.eye(1, 256, 9)[0]
    assert display.shown_field(changes, edit, "signed")[0, 0] == 0
    assert display.shown_field(changes, edit, "change")[0, 0] > 0


def test_rounding_is_not_shown():
    rounding = 1e-7 * np.random.default_rng(0).normal(size=(32, 32))
    assert display.scale_of(rounding) == display.FLOOR
    image = np.random.default_rng(1).random((32, 32, 3))
    found = display.overlay(image, rounding, display.scale_of(rounding), "change")
    gray = display.BACKDROP * image.mean(axis=-1, keepdims=True)
    np.testing.assert_allclose(found, np.broadcast_to(gray, found.shape), atol=1e-3)


@pytest.mark.parametrize("measure", ["change", "signed"])
def test_the_full_scale_has_the_end_of_the_colour_bar(measure):
    image = np.full((1, 3, 3), 0.6)
    found = display.overlay(image, np.array([[2.0, 0.0, -2.0]]), 1.0, measure)
    bar = display.color_bar(measure)
    np.testing.assert_allclose(found[0, 0], bar[-1])
    np.testing.assert_allclose(found[0, 1], display.BACKDROP * 0.6)
    np.testing.assert_allclose(found[0, 2], bar[0] if measure == "signed" else bar[-1])


def test_a_cosine_does_not_depend_on_strengths_and_is_0_for_nothing():
    a = np.random.default_rng(0).normal(size=50)
    assert display.cosine(a, -3 * a) == pytest.approx(-1)
    assert display.cosine(a, np.zeros(50)) == 0


IMAGE = np.full((2, 2, 3), 0.5)


def test_colours_compare_between_selections_and_opacity_does_not():
    whole = 1.0
    last = display.color_bar("all values", 256)[-1]
    weak, strong = np.array([[0.1, 0.0], [0.05, -0.1]]), np.array([[1.0, 0.0], [0.5, -1.0]])
    shown = [display.overlay_globally(IMAGE, f, display.scale_of(f), whole) for f in (weak, strong)]
    # Where a field is strongest, it is opaque, however weak it is beside the others.
    np.testing.assert_allclose(shown[0][0, 0], display.color_bar("all values", 256)[26], atol=0.02)
    np.testing.assert_allclose(shown[1][0, 0], last)
    np.testing.assert_allclose(shown[1][1, 1], last)
    for image in shown:
        np.testing.assert_allclose(image[0, 1], display.BACKDROP * 0.5)
    half = 0.5 * display.color_bar("all values", 256)[128] + 0.5 * display.BACKDROP * 0.5
    np.testing.assert_allclose(shown[1][1, 0], half, atol=0.01)
