from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QImage, QMouseEvent, QNativeGestureEvent, QPointingDevice, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from app.image_view.gestures import ViewGestures, notches_of, orbit, tumble, zoom
from app.image_view.image_canvas import ImageCanvas
from app.image_view.reference_controls import light_at
from app.state.viewer_state import HOME_VIEW, ViewerState
from model.scene.light import LightDirection, LightRange
from model.scene.orientation import angles_in
from model.scene.view import View


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
    drag(canvas, [(100, 50), (150, 100)], button, keys)
    assert state.view.roll == pytest.approx(90.0)
    # Where the volume is.
    state.set_view(View(pan_x=0.5, pan_y=0.5))
    drag(canvas, [(150, 20), (180, 50)], button, keys)
    assert state.view.roll == pytest.approx(90.0)


def scroll(widget: QWidget, at: QPointF, *, angle: int = 0, pixels: int = 0) -> None:
    event = QWheelEvent(
        at,
        widget.mapToGlobal(at),
        QPoint(0, pixels),
        QPoint(0, angle),
        Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(widget, event)


def test_the_wheel_zooms_to_the_cursor(qtbot: QtBot, state: ViewerState, canvas: QWidget) -> None:
    with qtbot.waitSignal(state.viewChangeFinished):
        # Parts of a notch, as wheels of high resolution send them.
        for _ in range(4):
            scroll(canvas, QPointF(150, 75), angle=30)
        assert state.live
    expected = zoom(HOME_VIEW, 1, (0.5, 0.25))
    got = state.view
    assert (got.distance, got.pan_x, got.pan_y) == pytest.approx(
        (expected.distance, expected.pan_x, expected.pan_y)
    )
    assert expected.pan_x < 0
    # A touchpad sends pixels.
    before = state.view.distance
    with qtbot.waitSignal(state.viewChangeFinished):
        scroll(canvas, QPointF(100, 100), pixels=20)
    assert zoom(got, 2).distance < state.view.distance < before


def test_a_pinch_zooms_and_ends_at_once(qtbot: QtBot, state: ViewerState, canvas: QWidget) -> None:
    def pinch(kind: Qt.NativeGestureType, value: float) -> None:
        at = QPointF(150, 100)
        touchpad = QPointingDevice.primaryPointingDevice()
        there = canvas.mapToGlobal(at)
        event = QNativeGestureEvent(kind, touchpad, 2, at, at, there, value, QPointF())
        QApplication.sendEvent(canvas, event)

    with qtbot.waitSignals([state.viewChanged, state.viewChangeFinished], order="strict"):
        pinch(Qt.NativeGestureType.BeginNativeGesture, 0.0)
        pinch(Qt.NativeGestureType.ZoomNativeGesture, 0.25)
        pinch(Qt.NativeGestureType.EndNativeGesture, 0.0)
        assert not state.live
    assert state.view == zoom(HOME_VIEW, notches_of(1.25), (0.5, 0.0))


@pytest.mark.parametrize(
    ("button", "keys"),
    [
        (Qt.MouseButton.MiddleButton, Qt.KeyboardModifier.NoModifier),
        (Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ShiftModifier),
    ],
)
@pytest.mark.parametrize(
    # The image's shorter side is 200 pixels, so that half of it is 100.
    ("size", "image"),
    [((400, 300), (200, 100)), ((200, 400), (100, 200))],
)
def test_the_picture_follows_a_panning_mouse_by_pixels(
    qtbot: QtBot,
    state: ViewerState,
    button: Qt.MouseButton,
    keys: Qt.KeyboardModifier,
    size: tuple[int, int],
    image: tuple[int, int],
) -> None:
    canvas = ImageCanvas()
    qtbot.addWidget(canvas)
    canvas.resize(*size)
    canvas.show_image(QImage(*image, QImage.Format.Format_RGB888))
    ViewGestures(canvas, state)
    drag(canvas, [(100, 100), (150, 100), (150, 70)], button, keys)
    assert (state.view.pan_x, state.view.pan_y) == pytest.approx((0.5, 0.3))


def test_dragging_turns_about_the_states_up_axis_or_freely(
    state: ViewerState, canvas: QWidget
) -> None:
    state.set_up_axis("+y")
    before = state.view
    drag(canvas, [(100, 100), (110, 100)])
    azimuth, elevation, turned = angles_in("+y", before)
    assert state.angles == pytest.approx((azimuth - 4.0, elevation, turned))
    state.set_trackball(True)
    before = state.view
    drag(canvas, [(100, 100), (110, 120)])
    assert state.view == tumble(before, 10, 20)


NONE, LEFT, RIGHT = Qt.MouseButton.NoButton, Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton
PRESS, MOVE = QEvent.Type.MouseButtonPress, QEvent.Type.MouseMove
RELEASE = QEvent.Type.MouseButtonRelease


def send(
    widget: QWidget,
    kind: QEvent.Type,
    x: int,
    y: int,
    button: Qt.MouseButton,
    held: Qt.MouseButton,
) -> None:
    """Send a mouse event; QTest forgets one button when another is pressed."""
    at, keys = QPointF(x, y), Qt.KeyboardModifier.NoModifier
    event = QMouseEvent(kind, at, widget.mapToGlobal(at), button, held, keys)
    QApplication.sendEvent(widget, event)


def test_another_button_changes_nothing_during_a_drag(state: ViewerState, canvas: QWidget) -> None:
    send(canvas, PRESS, 100, 100, LEFT, LEFT)
    send(canvas, MOVE, 110, 100, NONE, LEFT)
    send(canvas, PRESS, 110, 100, RIGHT, LEFT | RIGHT)
    send(canvas, RELEASE, 110, 100, RIGHT, LEFT)
    assert state.live
    send(canvas, MOVE, 110, 120, NONE, LEFT)
    send(canvas, RELEASE, 110, 120, LEFT, NONE)
    assert state.view == orbit(orbit(HOME_VIEW, 10, 0), 0, 20)
    assert not state.live


@pytest.mark.parametrize("kind", [MOVE, RELEASE])
def test_a_drag_whose_release_was_kept_from_it_ends(
    state: ViewerState, canvas: QWidget, kind: QEvent.Type
) -> None:
    canvas.setMouseTracking(True)
    send(canvas, PRESS, 100, 50, RIGHT, RIGHT)
    send(canvas, MOVE, 150, 100, NONE, RIGHT)
    rolled = state.view
    # A layer over the image took the right button's release.
    send(canvas, kind, 100, 150, NONE if kind == MOVE else LEFT, NONE)
    assert (state.live, state.view) == (False, rolled)
    send(canvas, MOVE, 50, 100, NONE, NONE)
    assert state.view == rolled


def test_with_control_and_shift_the_mouse_moves_a_light_that_is_movable(
    qtbot: QtBot, state: ViewerState, canvas: QWidget
) -> None:
    keys = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
    drag(canvas, [(100, 100), (150, 80)], keys=keys)
    assert (state.light, state.view) == (None, HOME_VIEW)
    state.light_input.set(LightDirection())
    signals = [
        state.light_input.changed,
        state.light_input.changed,
        state.light_input.changeFinished,
    ]
    with qtbot.waitSignals(signals, order="strict"):
        drag(canvas, [(100, 100), (150, 80)], keys=keys)
    assert state.light == light_at(0.5, 0.2, LightRange())
    assert (state.live, state.view) == (False, HOME_VIEW)


def test_a_double_click_goes_home(state: ViewerState, canvas: QWidget) -> None:
    state.start_view((0.6, 0.48, 0.64))
    home = state.view
    state.set_view(View(azimuth=200.0, roll=5.0))
    QTest.mouseDClick(canvas, Qt.MouseButton.LeftButton)
    assert state.view == home
    assert home != HOME_VIEW


def test_a_click_that_trembles_turns_nothing(state: ViewerState, canvas: QWidget) -> None:
    drag(canvas, [(100, 100), (102, 101), (101, 102)])
    assert state.view == HOME_VIEW
    assert not state.live
    # A drag turns by all of its way, also by its first pixels.
    drag(canvas, [(100, 100), (103, 100), (110, 100)])
    assert state.view == orbit(HOME_VIEW, 10, 0)
