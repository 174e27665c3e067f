"""Answers while something moves, compared with those at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QObject
from pytestqt.qtbot import QtBot

from app.engines.quality import Quality
from app.engines.requests import BatchRequest, RegionSensitivityRequest, ValueSensitivityRequest
from app.state.live_errors import LiveErrors
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View

LIVE, REST = Quality(8, live=True), Quality(16)


@pytest.fixture
def errors(qtbot: QtBot) -> LiveErrors:
    parent = QObject()
    found = LiveErrors(parent)
    # Else it goes with its parent, which nothing holds.
    found.setParent(None)
    return found


def inputs_from(azimuth: float) -> SceneInputs:
    mode = GaussianMode(0.5, 0.1, 0.5)
    colors = ColorTF((0.0, 1.0), ((0.0, 0.0, 0.0, 0.0), (1.0, 1.0, 1.0, 1.0)))
    return SceneInputs(View(azimuth), OpacityTF((0.0, 1.0), (mode,)), colors)


@pytest.fixture
def curve() -> RegionSensitivityRequest:
    return RegionSensitivityRequest(inputs_from(0.0), LIVE, Outline(), 6.0)


def at_rest(request: RegionSensitivityRequest) -> RegionSensitivityRequest:
    return replace(request, sequence=2, quality=REST)


def test_a_curve_is_compared_by_its_cosine(
    errors: LiveErrors, curve: RegionSensitivityRequest, qtbot: QtBot
) -> None:
    errors.take("curve", "exact", curve, np.array([3.0, 4.0], np.float32), 0.012)
    with qtbot.waitSignal(errors.changed):
        errors.take("curve", "exact", at_rest(curve), np.array([5.0, 0.0], np.float32), 0.2)
    found = errors.found["curve"]
    assert (found.seconds, found.error) == (0.012, None)
    assert found.cosine == pytest.approx(0.6)


def test_only_answers_to_one_question_are_compared(
    errors: LiveErrors, curve: RegionSensitivityRequest
) -> None:
    value = np.ones(2, np.float32)
    other = replace(curve, inputs=inputs_from(10.0))
    errors.take("curve", "exact", other, value, 0.1)
    errors.take("curve", "exact", at_rest(curve), value, 0.1)
    assert not errors.found
    # An answer is compared once, with what comes next.
    errors.take("curve", "exact", curve, value, 0.1)
    errors.take("curve", "exact", at_rest(other), value, 0.1)
    errors.take("curve", "exact", at_rest(curve), value, 0.1)
    assert not errors.found


def test_a_live_answer_of_the_generator_is_compared_with_the_renderers(
    errors: LiveErrors, curve: RegionSensitivityRequest
) -> None:
    live, own, true = (np.array(each, np.float32) for each in ([3, 4], [3, 4], [5, 0]))
    errors.take("curve", "learned", curve, live, 0.03)
    errors.take("curve", "learned", at_rest(curve), own, 0.03)
    assert not errors.found
    errors.take("curve", "exact", at_rest(curve), true, 0.2)
    assert errors.found["curve"].cosine == pytest.approx(0.6)


def test_fewer_pixels_are_enlarged_first(
    errors: LiveErrors, curve: RegionSensitivityRequest
) -> None:
    inputs = curve.inputs
    field = ValueSensitivityRequest(inputs, LIVE, (0.0, 1.0), 6.0)
    errors.take("field", "exact", field, np.ones((8, 12, 3), np.float32), 0.1)
    errors.take(
        "field", "exact", replace(field, quality=REST), np.ones((16, 24, 3), np.float32), 0.1
    )
    assert errors.found["field"].cosine == pytest.approx(1.0)

    grid = BatchRequest(inputs, LIVE)
    errors.take("map", "exact", grid, np.zeros((3, 8, 8, 4), np.float32), 0.1)
    rest = np.full((3, 16, 16, 4), 0.25, np.float32)
    errors.take("map", "exact", replace(grid, quality=REST), rest, 0.1)
    assert errors.found["map"].error == pytest.approx(0.25)
    errors.forget()
    assert not errors.found
