from __future__ import annotations

import math

import pytest
from PySide6.QtCore import QPoint, Qt
from pytestqt.qtbot import QtBot

from app.image_view.reference_controls import DIAMETER, REACH, LightBall, light_at
from app.state.viewer_state import ViewerState
from model.scene.light import LightDirection, LightRange

LIMITS = LightRange()


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (0.5, 0.3), (-0.6, 0.6), (0.1, -0.7)])
def test_the_light_shines_straight_onto_the_point(x: float, y: float) -> None:
    right, up, back = light_at(x, y, LIMITS).towards()
    assert (right, up) == (pytest.approx(x, abs=1e-9), pytest.approx(y, abs=1e-9))
    assert back == pytest.approx(math.sqrt(1 - x * x - y * y), abs=1e-9)


@pytest.mark.parametrize(("x", "y"), [(5.0, 0.0), (0.0, -3.0), (1.0, 1.0), (-1.0, 0.0)])
def test_beyond_the_rim_the_light_stays_in_its_range(x: float, y: float) -> None:
    light = light_at(x, y, LIMITS)
    assert abs(light.azimuth) <= LIMITS.max_azimuth
    assert abs(light.elevation) <= LIMITS.max_elevation


@pytest.fixture
def ball(qtbot: QtBot) -> LightBall:
    """A ball over a movable light from straight ahead."""
    state = ViewerState()
    state.light_input.set(LightDirection(0.0, 0.0))
    ball = LightBall(state)
    qtbot.addWidget(ball)
    state.setParent(ball)
    ball.set_light(LightDirection(), LIMITS)
    ball.show()
    return ball


MIDDLE = QPoint(DIAMETER // 2, DIAMETER // 2)


def test_dragging_moves_the_light_live_and_then_finally(qtbot: QtBot, ball: LightBall) -> None:
    state = ball._state
    # From anywhere: it is the movement that counts.
    start = MIDDLE + QPoint(5, -7)
    qtbot.mousePress(ball, Qt.MouseButton.LeftButton, pos=start)
    assert state.light == LightDirection(0.0, 0.0) and not state.live
    qtbot.mouseMove(ball, start + QPoint(round(REACH / 2), 0))
    assert state.live and state.light is not None
    assert state.light.azimuth == pytest.approx(30, abs=0.5)
    assert state.light.elevation == pytest.approx(0, abs=0.5)
    with qtbot.waitSignal(state.light_input.changeFinished):
        qtbot.mouseRelease(ball, Qt.MouseButton.LeftButton)
    assert not state.live
    qtbot.mouseDClick(ball, Qt.MouseButton.LeftButton)
    assert state.light == LightDirection()
    # A click puts the light there.
    qtbot.mouseClick(ball, Qt.MouseButton.LeftButton, pos=MIDDLE - QPoint(0, DIAMETER // 4))
    assert (state.light.azimuth, state.light.elevation) == pytest.approx((0, 28), abs=3)
