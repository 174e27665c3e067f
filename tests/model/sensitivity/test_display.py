import numpy as np
import pytest

from model.scene.tf_perturbation import edit_around
from model.sensitivity.display import (
    BACKDROP,
    FLOOR,
    color_bar,
    field_of_value,
    global_scale,
    overlay,
    overlay_globally,
    per_small_edit,
    scale_of,
    shown_field,
    shown_responses,
    spread_blocks,
)


def test_a_value_between_two_samples_is_interpolated():
    field = np.arange(256, dtype=np.float32) * np.ones((2, 3, 1), np.float32)
    # 256 samples from 10 to 265: one per unit.
    for value in (10.0, 77.25, 265.0):
        found = field_of_value(field, value, (10.0, 265.0))
        assert found.shape == (2, 3)
        np.testing.assert_allclose(found, value - 10.0, rtol=1e-5)


def test_without_a_value_each_counts_by_its_own_maximum():
    field = np.zeros((1, 2, 256), np.float32)
    field[0, 0, 5], field[0, 1, 5] = -4.0, 2.0
    field[0, 1, 9] = 0.001
    np.testing.assert_allclose(
        field_of_value(field, None, (0.0, 1.0)), [[1 / 256, 1.5 / 256]], rtol=1e-5
    )


def test_the_unit_is_an_edit_that_adds_a_hundredth_at_its_peak():
    edit = edit_around(128.0, (0.0, 255.0), 6.0)
    assert per_small_edit(edit) * edit.max() == pytest.approx(0.01)
    # A picture whose every number changes by 2 per unit of the edit.
    changes = np.full((8, 8, 3), 2.0, np.float32)
    expected = 2.0 * per_small_edit(edit)
    np.testing.assert_allclose(shown_field(changes, edit, "change"), expected)
    np.testing.assert_allclose(shown_field(-changes, edit, "signed"), -expected)
    norm = np.full(256, np.linalg.norm(changes))
    np.testing.assert_allclose(shown_responses(norm, 64, 6.0), expected, rtol=1e-5)


def test_what_brightens_one_colour_and_darkens_another_is_a_change():
    changes = np.array([[[1.0, -1.0, 0.0]]])
    edit = np.eye(1, 256, 9)[0]
    assert shown_field(changes, edit, "signed")[0, 0] == 0
    assert shown_field(changes, edit, "change")[0, 0] > 0


def test_rounding_is_not_shown():
    rounding = 1e-7 * np.random.default_rng(0).normal(size=(32, 32))
    assert scale_of(rounding) == FLOOR
    image = np.random.default_rng(1).random((32, 32, 3))
    found = overlay(image, rounding, scale_of(rounding), "change")
    gray = BACKDROP * image.mean(axis=-1, keepdims=True)
    np.testing.assert_allclose(found, np.broadcast_to(gray, found.shape), atol=1e-3)


@pytest.mark.parametrize("measure", ["change", "signed"])
def test_the_full_scale_has_the_end_of_the_colour_bar(measure):
    image = np.full((1, 3, 3), 0.6)
    found = overlay(image, np.array([[2.0, 0.0, -2.0]]), 1.0, measure)
    bar = color_bar(measure)
    np.testing.assert_allclose(found[0, 0], bar[-1])
    np.testing.assert_allclose(found[0, 1], BACKDROP * 0.6)
    np.testing.assert_allclose(found[0, 2], bar[0] if measure == "signed" else bar[-1])


def test_blocks_are_spread_over_their_pixels():
    found = spread_blocks(np.array([[1.0, 2.0, 3.0]] * 3, np.float32), 5, 2)
    assert found[4].tolist() == [1, 1, 2, 2, 3]
    assert found.shape == (5, 5)


IMAGE = np.full((2, 2, 3), 0.5)


def test_the_scale_of_all_values_is_in_the_unit_of_one():
    # A block in which each of its 16 pixels' colours changes by the same amount, per edit.
    width, change = 6.0, 0.7
    edit = edit_around(0.5, (0.0, 1.0), width)
    shown = shown_field(np.full((4, 4, 3), change), edit, "change")
    norm = change * np.sqrt(3 * 16)
    fields = np.full((2, 2, 256), norm, dtype=np.float32)
    assert global_scale(fields, 16, width) == pytest.approx(shown[0, 0], rel=1e-5)
    assert shown[0, 0] == pytest.approx(change * per_small_edit(edit))


def test_colours_compare_between_selections_and_opacity_does_not():
    whole = 1.0
    last = color_bar("all values", 256)[-1]
    weak, strong = np.array([[0.1, 0.0], [0.05, -0.1]]), np.array([[1.0, 0.0], [0.5, -1.0]])
    shown = [overlay_globally(IMAGE, f, scale_of(f), whole) for f in (weak, strong)]
    # Where a field is strongest, it is opaque, however weak it is beside the others.
    np.testing.assert_allclose(shown[0][0, 0], color_bar("all values", 256)[26], atol=0.02)
    np.testing.assert_allclose(shown[1][0, 0], last)
    np.testing.assert_allclose(shown[1][1, 1], last)
    for image in shown:
        np.testing.assert_allclose(image[0, 1], BACKDROP * 0.5)
    half = 0.5 * color_bar("all values", 256)[128] + 0.5 * BACKDROP * 0.5
    np.testing.assert_allclose(shown[1][1, 0], half, atol=0.01)
