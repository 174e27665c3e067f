"""Flicker against pictures whose changes are known."""

from __future__ import annotations

import numpy as np
import pytest

from model.benchmarks.flicker import flicker


@pytest.mark.parametrize(("noise", "steps"), [(0.0, 0.0), (1 / 255, 4.0)])
def test_it_is_what_the_scene_does_not_change(noise: float, steps: float) -> None:
    # The scene's brightness grows with the square of time; noise changes sign in each frame.
    def draw(frame: int, share: float = 0.0) -> np.ndarray:
        return np.full((4, 4, 4), 0.01 * frame**2 + share * (-1) ** frame)

    found = flicker({"noisy": lambda frame: draw(frame, noise)}, draw, [0, 1, 2, 3, 4], first=1)
    noisy = found["noisy"]
    assert (noisy.most, noisy.mean) == pytest.approx((steps, steps))
    assert noisy.error == pytest.approx(noise) and noisy.seconds > 0
