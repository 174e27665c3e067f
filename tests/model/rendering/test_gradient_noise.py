"""Noise of gradients, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from model.rendering.gradient_noise import gradient_noise


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (0.5, 0.5, 2.0), (3e-9, 1e-9, 2e-9)])
def test_white_noise_has_six_times_its_variance(spacing: tuple[float, float, float]) -> None:
    """Each difference of two values has twice their variance, and there are three of them."""
    scalars = 100 + np.random.default_rng(3).normal(0, 2.0, (40, 50, 60))
    unit = math.prod(spacing) ** (1 / 3)
    expected = 2.0 / 200 * math.sqrt(2 * sum((unit / edge) ** 2 for edge in spacing))
    found = gradient_noise(scalars, (0.0, 200.0), spacing)
    assert found == pytest.approx(expected, rel=0.05)


def test_what_is_resolved_is_no_noise() -> None:
    z, y, x = np.mgrid[-1:1:40j, -1:1:40j, -1:1:40j]
    waves = np.sin(4 * x) + np.cos(5 * y) * z
    assert gradient_noise(waves, (-2.0, 2.0), (1.0, 1.0, 1.0)) == 0
    assert gradient_noise(np.round(1000 * waves), (-2e3, 2e3), (1.0, 1.0, 1.0)) == 0


def test_a_scan_is_noisy_in_spite_of_its_surfaces_and_of_clipped_air() -> None:
    z, y, x = np.mgrid[-1:1:48j, -1:1:48j, -1:1:48j]
    ball = 150 * np.clip(10 * (0.8 - np.sqrt(x**2 + y**2 + z**2)), 0, 1)
    noise = np.random.default_rng(4).normal(0, 3.0, ball.shape)
    scan = np.where(ball > 0, ball + noise, 0)
    found = gradient_noise(scan, (0.0, 200.0), (1.0, 1.0, 1.0))
    assert found == pytest.approx(3.0 / 200 * math.sqrt(6), rel=0.15)


def test_flat_and_tiny_volumes_have_none() -> None:
    flat = np.full((20, 20, 20), 7, np.uint8)
    flat[0, 0, 0] = 0
    assert gradient_noise(flat, (0.0, 7.0), (1.0, 1.0, 1.0)) == 0
    tiny = np.random.default_rng(5).random((4, 20, 20))
    assert gradient_noise(tiny, (0.0, 1.0), (1.0, 1.0, 1.0)) == 0
