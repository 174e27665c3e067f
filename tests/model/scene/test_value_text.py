import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.scene.transfer_function import TF_SAMPLES
from model.scene.value_text import range_text, value_text


@pytest.mark.parametrize(
    ("value", "scalar_range", "text"),
    [
        (67.4666, (0.0, 255.0), "67"),
        (-612.2, (-1024.0, 3071.0), "-612"),
        (0.6127, (0.0, 1.0), "0.613"),
        (2.3254e-8, (0.0, 1e-7), "2.33e-08"),
        (1234567.8, (0.0, 2e6), "1.235e+06"),
        (-0.0001, (-1.0, 1.0), "0.000"),
        (0.0, (0.0, 1e-9), "0"),
    ],
)
def test_as_many_digits_as_a_tf_tells_apart(value, scalar_range, text):
    assert value_text(value, scalar_range, "linear") == text


@given(st.floats(-1e9, 1e9), st.floats(1e-12, 1e12, exclude_min=True), st.floats(0, 1))
def test_the_text_is_right_to_within_a_bin(low, extent, part):
    high = low + extent
    if high - low < 1e-9 * max(abs(low), abs(high), 1e-300):
        return
    value = low + part * (high - low)
    error = abs(float(value_text(value, (low, high), "linear")) - value)
    assert error <= 1.001 * (high - low) / (TF_SAMPLES - 1)


@pytest.mark.parametrize(
    ("values", "scalar_range", "text"),
    [
        ((260.2, 1899.7), (-1024.0, 3071.0), "260 to 1,900"),
        ((-1000.0, -612.0), (-1024.0, 3071.0), "-1,000 to -612"),
        ((0.25, 0.5), (0.0, 1.0), "0.250 to 0.500"),
        ((67.4, 66.8), (0.0, 255.0), "67"),
        ((1e-8, 2e-8), (0.0, 1e-7), "1e-08 to 2e-08"),
    ],
)
def test_ranges_have_their_thousands_set_apart(values, scalar_range, text):
    assert range_text(values, scalar_range, "linear") == text
