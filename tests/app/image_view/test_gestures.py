from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from app.image_view.gestures import FARTHEST, NEAREST, ViewGestures, orbit, roll, zoom
from app.state.viewer_state import HOME_VIEW, ViewerState
from model.scene.view import View

views = st.builds(
    View,
    azimuth=st.floats(0, 359),
    elevation=st.floats(-60, 60),
    roll=st.floats(-180, 180),
)


@given(views, st.floats(0, 360))
def test_the_volume_follows_the_mouse(view: View, direction: float) -> None:
    dx, dy = np.cos(np.radians(direction)), np.sin(np.radians(direction))
    front = view.basis()[2]
    right, up, _ = orbit(view, dx, dy).basis()
    moved = np.array([front @ right, -(front @ up)])
    assert moved @ [dx, dy] > 0.99 * np.cos(np.radians(view.elevation)) * np.linalg.norm(moved)
    assert moved @ [dx, dy] > 0


def test_the_volume_follows_the_mouse_exactly_at_the_equator() -> None:
    view = View(roll=37.0)
    front = view.basis()[2]
    right, up, _ = orbit(view, 0.3, 0.4).basis()
    moved = np.array([front @ right, -(front @ up)])
    assert moved / np.linalg.norm(moved) == pytest.approx([0.6, 0.8], abs=1e-3)


@given(views, st.floats(1, 80))
def test_rolling_turns_the_picture_clockwise(view: View, degrees: float) -> None:
    top = view.basis()[1]
    turned = roll(view, degrees)
    right, up, _ = turned.basis()
    assert np.degrees(np.arctan2(top @ right, top @ up)) == pytest.approx(degrees)
    assert -180 <= turned.roll < 180


def test_the_poles_are_a_limit() -> None:
    assert orbit(View(elevation=89.0), 0, 1000).elevation == 90.0
    assert orbit(View(elevation=-89.0), 0, -1000).elevation == -90.0


def test_zooming_has_limits_and_can_be_taken_back() -> None:
    view = View(distance=0.8)
    assert zoom(view, 1).distance < 0.8
    assert zoom(zoom(view, 3), -3).distance == pytest.approx(0.8)
    assert zoom(view, 1000).distance == NEAREST
    assert zoom(view, -1000).distance == FARTHEST


@pytest.fixture
def canvas(qtbot: QtBot, state: ViewerState) -> Iterator[QWidget]:
    widget = QWidget()
    widget.resize(200, 200)
    ViewGestures(widget, state)
    qtbot.addWidget(widget)
    widget.show()
    yield widget
    state.finish_view()


def drag(
    widget: QWidget,
    points: list[tuple[int, int]],
    button: Qt.MouseButton = Qt.MouseButton.LeftButton,
    keys: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier,
) -> None:
    QTest.mousePress(widget, button, keys, QPoint(*points[0]))
    for point in points[1:]:
        QTest.mouseMove(widget, QPoint(*point))
    QTest.mouseRelease(widget, button, keys, QPoint(*points[-1]))


def test_dragging_orbits_live_and_finishes_on_release(
    qtbot: QtBot, state: ViewerState, canvas: QWidget
) -> None:
    signals = [state.viewChanged, state.viewChanged, state.viewChangeFinished]
    with qtbot.waitSignals(signals, order="strict"):
        drag(canvas, [(100, 100), (110, 100), (110, 120)])
    assert state.view == orbit(orbit(HOME_VIEW, 10, 0), 0, 20)


@pytest.mark.parametrize(
    ("button", "keys"),
    [
        (Qt.MouseButton.RightButton, Qt.KeyboardModifier.NoModifier),
        (Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ControlModifier),
    ],
)
def test_a_quarter_turn_about_the_centre_rolls_by_90_degrees(
    state: ViewerState, canvas: QWidget, button: Qt.MouseButton, keys: Qt.KeyboardModifier
) -> None:
    center = canvas.rect().center()
    above = (center.x(), center.y() - 50)
    to_the_right = (center.x() + 50, center.y())
    drag(canvas, [above, to_the_right], button, keys)
    assert state.view.roll == pytest.approx(90.0)


def test_the_wheel_zooms_live_and_comes_to_rest(
    qtbot: QtBot, state: ViewerState, canvas: QWidget
) -> None:
    center = QPointF(canvas.rect().center())
    event = QWheelEvent(
        center,
        canvas.mapToGlobal(center),
        QPoint(),
        QPoint(0, 240),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    with qtbot.waitSignals([state.viewChanged, state.viewChangeFinished], order="strict"):
        QApplication.sendEvent(canvas, event)
    assert state.view == zoom(HOME_VIEW, 2)


def test_a_double_click_goes_home(state: ViewerState, canvas: QWidget) -> None:
    state.set_view(View(azimuth=200.0, roll=5.0))
    QTest.mouseDClick(canvas, Qt.MouseButton.LeftButton)
    assert state.view == HOME_VIEW
