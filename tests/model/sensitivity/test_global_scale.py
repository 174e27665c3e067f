import numpy as np
import pytest

from model.scene.tf_perturbation import edit_around
from model.sensitivity.display import BACKDROP, per_small_edit, scale_of, shown_field
from model.sensitivity.global_scale import global_color_bar, global_scale, overlay_globally

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
    last = global_color_bar(256)[-1]
    weak, strong = np.array([[0.1, 0.0], [0.05, -0.1]]), np.array([[1.0, 0.0], [0.5, -1.0]])
    shown = [overlay_globally(IMAGE, f, scale_of(f), whole) for f in (weak, strong)]
    # Where a field is strongest, it is opaque, however weak it is beside the others.
    np.testing.assert_allclose(shown[0][0, 0], global_color_bar(256)[26], atol=0.02)
    np.testing.assert_allclose(shown[1][0, 0], last)
    np.testing.assert_allclose(shown[1][1, 1], last)
    for image in shown:
        np.testing.assert_allclose(image[0, 1], BACKDROP * 0.5)
    half = 0.5 * global_color_bar(256)[128] + 0.5 * BACKDROP * 0.5
    np.testing.assert_allclose(shown[1][1, 0], half, atol=0.01)
