"""Flicker against pictures whose changes are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from model.benchmarks import flicker as module
from model.benchmarks.flicker import flicker


@pytest.mark.parametrize(("noise", "steps"), [(0.0, 0.0), (1 / 255, 4.0)])
def test_it_is_what_the_scene_does_not_change(
    monkeypatch: pytest.MonkeyPatch, noise: float, steps: float
) -> None:
    # The scene's brightness grows with the square of time; noise changes sign in each frame.
    def drawn(tracer, frame, size, samples, cleaning):
        value = 0.01 * frame**2 + (noise * (-1) ** frame if tracer == "few" else 0.0)
        return SimpleNamespace(rgba=np.full((size, size, 4), value))

    monkeypatch.setattr(module, "drawn", drawn)
    found = flicker("few", {"alone": None}, "many", [0, 1, 2, 3], 4, 1, 64)
    assert found == {"alone": pytest.approx(steps)}
