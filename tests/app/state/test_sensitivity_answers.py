from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from ramp import make_tf

from app.engines.requests import Quality, RegionSensitivityRequest
from app.state.sensitivity_answers import Answer, displayed
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.view import View
from model.sensitivity.display import agreement


def answered(size: int, strength: float, shift: float = 0.0) -> NDArray[np.float64]:
    """Responses of an image in which every pixel changes alike."""
    inputs = SceneInputs.of(View(), make_tf())
    request = RegionSensitivityRequest(inputs, Quality(size), Outline(), 3.0)
    curve = np.exp(-((np.arange(256) - 120 - shift) ** 2) / 200)
    # The change of a norm grows with the root of the number of pixels.
    value = (strength * size * curve).astype(np.float32)
    return displayed(Answer(request, value, "exact"))


def test_strengths_are_compared_whatever_the_numbers_of_pixels() -> None:
    found = agreement(answered(128, 0.3), answered(256, 0.1))
    assert found is not None
    assert found.cosine == pytest.approx(1.0)
    assert found.strength == pytest.approx(3.0)
    apart = agreement(answered(128, 0.1), answered(128, 0.1, shift=80.0))
    assert apart is not None
    assert apart.cosine < 0.1 and apart.strength == pytest.approx(1.0)
    assert agreement(answered(128, 0.0), answered(128, 0.0)) is None
