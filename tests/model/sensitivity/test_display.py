from __future__ import annotations

import numpy as np
import pytest

from model.sensitivity.display import BACKDROP, FALLING, RISING, field_of_value, overlay


def test_a_value_between_two_samples_is_interpolated() -> None:
    field = np.arange(256, dtype=np.float32) * np.ones((2, 3, 1), np.float32)
    # 256 samples from 10 to 265: one per unit.
    for value in (10.0, 77.25, 265.0):
        found = field_of_value(field, value, (10.0, 265.0))
        assert found.shape == (2, 3)
        np.testing.assert_allclose(found, value - 10.0, rtol=1e-5)


def test_without_a_value_each_counts_by_its_own_maximum() -> None:
    field = np.zeros((1, 2, 256), np.float32)
    field[0, 0, 5], field[0, 1, 5] = -4.0, 2.0
    field[0, 1, 9] = 0.001
    np.testing.assert_allclose(
        field_of_value(field, None, (0.0, 1.0)), [[1 / 256, 1.5 / 256]], rtol=1e-5
    )


def test_blocks_are_coloured_by_sign_over_the_dimmed_image() -> None:
    image = np.full((5, 5, 3), 0.6, np.float32)
    field = np.array([[2.0, 0.0, -1.0]] * 3, np.float32)
    found = overlay(image, field, 2)
    assert found.shape == (5, 5, 3)
    gray = BACKDROP * 0.6
    for x in (0, 1):
        np.testing.assert_allclose(found[4, x], RISING)
    for x in (2, 3):
        np.testing.assert_allclose(found[0, x], gray, rtol=1e-6)
    np.testing.assert_allclose(found[2, 4], gray / 2 + FALLING / 2, rtol=1e-6)


def test_a_field_of_zeros_leaves_the_dimmed_image() -> None:
    image = np.random.default_rng(0).random((4, 4, 3)).astype(np.float32)
    found = overlay(image, np.zeros((2, 2), np.float32), 2)
    assert found[1, 3].tolist() == pytest.approx([BACKDROP * image[1, 3].mean()] * 3, rel=1e-5)
