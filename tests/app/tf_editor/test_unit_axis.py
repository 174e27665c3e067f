import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from app.tf_editor.unit_axis import OpacityScale, ScalarAxis, ticks

RANGES = [
    (0.0, 1.0), (-1000.0, 3095.0), (0.0, 255.0), (1e-15, 3e-15), (1e9, 1e9 + 1.0), (-7e12, 5e12),
    (0.0, 0.3),
]  # fmt: skip


@pytest.mark.parametrize("scalar_range", RANGES)
@given(share=st.floats(0, 1))
@example(share=2.36e-10)
def test_places_and_values_are_each_others_inverse(scalar_range, share):
    axis = ScalarAxis.over(scalar_range)
    value = axis.value(share)
    assert scalar_range[0] <= value <= scalar_range[1]
    assert axis.place(value) == pytest.approx(share, abs=1e-6)


@pytest.mark.parametrize("scalar_range", RANGES)
def test_ticks_say_the_value_at_their_place(scalar_range):
    lo, hi = scalar_range
    marks = ticks(scalar_range)
    assert 3 <= len(marks) <= 8
    assert len({text for _, text in marks}) == len(marks)
    for place, text in marks:
        assert -1e-6 <= place <= 1 + 1e-6
        assert float(text) == pytest.approx(lo + place * (hi - lo), abs=1e-3 * (hi - lo))


@pytest.mark.parametrize(
    ("full", "numbers", "texts"),
    [
        ((-0.54, 5.5), {}, ["0", "1", "2", "3", "4", "5"]),
        ((-0.54, 2.5), {0: 0, 1: 17, 2: 2035}, ["0", "17", "2035"]),
        ((-1.2, 100.3), {}, ["−1", "0", "20", "40", "60", "80", "100"]),
    ],
)
def test_an_axis_of_labels_has_whole_numbers_and_ends_at_labels(full, numbers, texts):
    assert [text for _, text in ScalarAxis.over(full, numbers=numbers).marks()] == texts


@pytest.mark.parametrize("logarithmic", [False, True])
def test_opacities_come_back_from_their_heights(logarithmic):
    scale = OpacityScale(logarithmic)
    opacities = np.array([0.0, 1e-5, 0.001, 0.02, 0.5, 1.0])
    heights = scale.heights(opacities)
    assert (heights[0], heights[-1]) == (0.0, pytest.approx(1.0))
    assert (np.diff(heights) > 0).all()
    assert [scale.opacity(height) for height in heights] == pytest.approx(list(opacities))
    assert np.isfinite(scale.opacity(1e9)) and np.isfinite(scale.opacity(-1e9))


def test_a_hundredth_has_room_on_the_logarithmic_scale():
    assert OpacityScale(True).height(0.01) > 0.25
    assert [text for _, text in OpacityScale(True).ticks()] == ["0", "", ".01", ".1", "1"]
