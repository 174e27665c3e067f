import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mouse_events import drag, wheel
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import (
    QFocusEvent,
    QImage,
    QKeyEvent,
    QKeySequence,
    QMouseEvent,
    QNativeGestureEvent,
    QPointingDevice,
    QShortcut,
)
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from scipy.spatial.transform import Rotation

from app.image_view import gestures
from app.image_view.image_canvas import ImageCanvas
from app.image_view.reference_controls import light_at
from app.state.view_navigation import HOME_VIEW
from model.scene.orientation import angles_in, view_in
from model.scene.scene import LightDirection, LightRange
from model.scene.view import AXES, VIEW_ANGLE, Projection, View, axis_direction


def test_dragging_orbits_live_and_finishes_on_release(qtbot, state, canvas):
    signals = [state.viewChanged, state.viewChanged, state.viewChangeFinished]
    with qtbot.waitSignals(signals, order="strict"):
        drag(canvas, QPoint(100, 100), QPoint(110, 100), QPoint(110, 120))
    assert state.view == gestures.orbit(gestures.orbit(HOME_VIEW, 10, 0), 0, 20)


NONE, LEFT, RIGHT = Qt.MouseButton.NoButton, Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton
PLAIN, SHIFT = Qt.KeyboardModifier.NoModifier, Qt.KeyboardModifier.ShiftModifier
CONTROL = Qt.KeyboardModifier.ControlModifier


@pytest.mark.parametrize(("button", "keys"), [(RIGHT, PLAIN), (LEFT, CONTROL)])
def test_a_quarter_turn_about_the_centre_rolls_by_90_degrees(state, canvas, button, keys):
    drag(canvas, QPoint(100, 50), QPoint(150, 100), button=button, keys=keys)
    assert state.view.roll == pytest.approx(90.0)
    # Where the volume is.
    state.set_view(View(pan_x=0.5, pan_y=0.5))
    drag(canvas, QPoint(150, 20), QPoint(180, 50), button=button, keys=keys)
    assert state.view.roll == pytest.approx(90.0)


def test_the_wheel_zooms_to_the_cursor(qtbot, state, canvas):
    with qtbot.waitSignal(state.viewChangeFinished):
        # Parts of a notch, as wheels of high resolution send them.
        for _ in range(4):
            wheel(canvas, QPointF(150, 75), 0.25)
        assert state.live
    expected = gestures.zoom(HOME_VIEW, 1, (0.5, 0.25))
    got = state.view
    wanted = expected.distance, expected.pan_x, expected.pan_y
    assert (got.distance, got.pan_x, got.pan_y) == pytest.approx(wanted)
    assert expected.pan_x < 0
    # A touchpad sends pixels.
    before = state.view.distance
    with qtbot.waitSignal(state.viewChangeFinished):
        wheel(canvas, QPointF(100, 100), pixels=20)
    assert gestures.zoom(got, 2).distance < state.view.distance < before


def test_a_pinch_zooms_and_ends_at_once(qtbot, state, canvas):
    def pinch(kind, value):
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
    assert state.view == gestures.zoom(HOME_VIEW, gestures.notches_of(1.25), (0.5, 0.0))


@pytest.mark.parametrize(("button", "keys"), [(Qt.MouseButton.MiddleButton, PLAIN), (LEFT, SHIFT)])
# The image's shorter side is 200 pixels, so that half of it is 100.
@pytest.mark.parametrize(("size", "image"), [((400, 200), (200, 100)), ((200, 400), (100, 200))])
def test_the_picture_follows_a_panning_mouse_by_pixels(qtbot, state, button, keys, size, image):
    canvas = ImageCanvas()
    qtbot.addWidget(canvas)
    canvas.resize(*size)
    canvas.show_image(QImage(*image, QImage.Format.Format_RGB888))
    gestures.ViewGestures(canvas, state)
    drag(canvas, QPoint(100, 100), QPoint(150, 100), QPoint(150, 70), button=button, keys=keys)
    assert (state.view.pan_x, state.view.pan_y) == pytest.approx((0.5, 0.3))


def test_dragging_turns_about_the_states_up_axis_or_freely(state, canvas):
    state.set_up_axis("+y")
    before = state.view
    drag(canvas, QPoint(100, 100), QPoint(110, 100))
    azimuth, elevation, turned = angles_in("+y", before)
    assert state.angles == pytest.approx((azimuth - 4.0, elevation, turned))
    state.set_trackball(True)
    before = state.view
    drag(canvas, QPoint(100, 100), QPoint(110, 120))
    assert state.view == gestures.tumble(before, 10, 20)


PRESS, MOVE = QEvent.Type.MouseButtonPress, QEvent.Type.MouseMove
RELEASE = QEvent.Type.MouseButtonRelease


def send(widget, kind, x, y, button, held):
    """Send a mouse event; QTest forgets one button when another is pressed."""
    at = QPointF(x, y)
    event = QMouseEvent(kind, at, widget.mapToGlobal(at), button, held, PLAIN)
    QApplication.sendEvent(widget, event)


@pytest.mark.parametrize("kind", [MOVE, RELEASE])
def test_a_drag_whose_release_was_kept_from_it_ends(state, canvas, kind):
    canvas.setMouseTracking(True)
    send(canvas, PRESS, 100, 50, RIGHT, RIGHT)
    send(canvas, MOVE, 150, 100, NONE, RIGHT)
    rolled = state.view
    # A layer over the image took the right button's release.
    send(canvas, kind, 100, 150, NONE if kind == MOVE else LEFT, NONE)
    assert (state.live, state.view) == (False, rolled)
    send(canvas, MOVE, 50, 100, NONE, NONE)
    assert state.view == rolled


def test_with_control_and_shift_the_mouse_moves_a_light_that_is_movable(qtbot, state, canvas):
    keys = CONTROL | SHIFT
    drag(canvas, QPoint(100, 100), QPoint(150, 80), keys=keys)
    assert (state.light, state.view) == (None, HOME_VIEW)
    state.light_input.set(LightDirection())
    signals = [state.light_input.changed] * 2 + [state.light_input.changeFinished]
    with qtbot.waitSignals(signals, order="strict"):
        drag(canvas, QPoint(100, 100), QPoint(150, 80), keys=keys)
    assert state.light == light_at(0.5, 0.2, LightRange())
    assert (state.live, state.view) == (False, HOME_VIEW)


def test_a_double_click_goes_home(state, canvas):
    state.start_view((0.6, 0.48, 0.64))
    home = state.view
    state.set_view(View(azimuth=200.0, roll=5.0))
    QTest.mouseDClick(canvas, Qt.MouseButton.LeftButton)
    assert state.view == home
    assert home != HOME_VIEW


def test_a_click_that_trembles_turns_nothing(state, canvas):
    drag(canvas, QPoint(100, 100), QPoint(102, 101), QPoint(101, 102))
    assert state.view == HOME_VIEW
    assert not state.live
    # A drag turns by all of its way, also by its first pixels.
    drag(canvas, QPoint(100, 100), QPoint(103, 100), QPoint(110, 100))
    assert state.view == gestures.orbit(HOME_VIEW, 10, 0)


angles = {"azimuth": st.floats(0, 359), "elevation": st.floats(-60, 60)}
views = st.builds(View, **angles, roll=st.floats(-180, 180))


@pytest.mark.parametrize("up", AXES)
def test_orbiting_turns_about_the_up_axis(up):
    view = view_in(up, 20.0, 35.0, 0.0, View(0.0, 0.0, 0.0, 0.6, 0.1, 0.2, is_orthographic=True))
    before, axis = view.basis(), axis_direction(up)
    after = gestures.orbit(view, 50.0, 0.0, up)
    # The camera goes round the other way.
    turned = Rotation.from_rotvec(math.radians(-50 * gestures.DEGREES_PER_PIXEL) * axis)
    np.testing.assert_allclose(after.basis(), turned.apply(before), atol=1e-9)
    kept = after.distance, after.pan_x, after.pan_y, after.is_orthographic
    assert kept == (0.6, 0.1, 0.2, True)
    assert gestures.orbit(view, 0, 1000.0, up).basis()[2] == pytest.approx(axis, abs=1e-9)


@given(views, st.floats(-300, 300), st.floats(-300, 300))
def test_tumbling_turns_about_the_images_own_axes(view, dx, dy):
    after = gestures.tumble(replace(view, pan_x=0.5), dx, dy)
    # To the right is about the image's up axis; down about its right one.
    turned = Rotation.from_rotvec(np.radians(gestures.DEGREES_PER_PIXEL) * np.array([dy, dx, 0.0]))
    np.testing.assert_allclose(after.basis(), turned.as_matrix() @ view.basis(), atol=1e-8)
    assert after.pan_x == 0.5


@given(views, st.floats(-5, 5), st.floats(-1, 1), st.floats(-1, 1))
def test_what_lies_under_the_cursor_stays_there(view, notches, x, y):
    view = replace(view, pan_x=0.3, pan_y=-0.4, distance=0.7)
    right, up, _ = view.basis()
    # The point of the plane through the centre that is seen at (x, y), in radii of a cube.
    scale = view.camera_distance(1.0) * math.tan(math.radians(VIEW_ANGLE / 2))
    point = scale * ((x - view.pan_x) * right + (y - view.pan_y) * up)
    proportions = np.full(3, 3**-0.5)
    for seen in (view, gestures.zoom(view, notches, (x, y))):
        places = Projection(seen, proportions).places(0.5 + point[None] / 2 / proportions)
        np.testing.assert_allclose(places, [[x, y]], atol=1e-9)


@pytest.fixture
def image(qtbot, state):
    widget = QWidget()
    gestures.ViewKeys(widget, state)
    qtbot.addWidget(widget)
    yield widget
    state.finish_view()


@pytest.mark.parametrize(("key", "keys", "expected"), [
    (Qt.Key.Key_Right, PLAIN, View(25.0, 15.0, 0.0, 0.8)),
    (Qt.Key.Key_Left, SHIFT, View(31.0, 15.0, 0.0, 0.8)),
    (Qt.Key.Key_Down, SHIFT, View(30.0, 16.0, 0.0, 0.8)),
    (Qt.Key.Key_Right, CONTROL, View(30.0, 15.0, 0.0, 0.8, 0.1, 0.0)),
    (Qt.Key.Key_Down, CONTROL | SHIFT, View(30.0, 15.0, 0.0, 0.8, 0.0, -0.02)),
    (Qt.Key.Key_PageDown, PLAIN, View(30.0, 15.0, 5.0, 0.8)),
    (Qt.Key.Key_Plus, SHIFT, gestures.zoom(HOME_VIEW, 1)),
    (Qt.Key.Key_Minus, Qt.KeyboardModifier.KeypadModifier, gestures.zoom(HOME_VIEW, -1)),
    (Qt.Key.Key_Left, Qt.KeyboardModifier.AltModifier, HOME_VIEW), (Qt.Key.Key_R, PLAIN, HOME_VIEW),
])  # fmt: skip
def test_keys(state, image, key, keys, expected):
    QTest.keyClick(image, key, keys)
    got, want = vars(state.view), vars(expected)
    assert [*got.values()] == pytest.approx([*want.values()], abs=1e-9)
    assert not state.live


def repeat(image, kind):
    event = QKeyEvent(kind, Qt.Key.Key_Right, PLAIN, "", True)
    QApplication.sendEvent(image, event)


def test_a_key_that_is_held_is_a_drag(qtbot, state, image):
    signals = [state.viewChanged] * 3 + [state.viewChangeFinished]
    with qtbot.waitSignals(signals, order="strict"):
        QTest.keyPress(image, Qt.Key.Key_Right)
        for _ in range(2):
            # As Qt reports it: a release and a press for every repetition.
            repeat(image, QEvent.Type.KeyRelease)
            repeat(image, QEvent.Type.KeyPress)
        assert state.live
        QTest.keyRelease(image, Qt.Key.Key_Right)
    assert state.view.azimuth == pytest.approx(15.0)
    # It ends when the focus goes, too.
    QTest.keyPress(image, Qt.Key.Key_Right)
    assert state.live
    QApplication.sendEvent(image, QFocusEvent(QEvent.Type.FocusOut))
    assert not state.live


def test_the_image_gets_its_keys_before_shortcuts(qtbot, state, image):
    called = []
    QShortcut(QKeySequence("Home"), image).activated.connect(lambda: called.append(True))
    state.set_view(View(100.0))
    image.show()
    image.activateWindow()
    image.setFocus()
    qtbot.waitUntil(image.hasFocus)
    QTest.keyClick(image, Qt.Key.Key_Home)
    assert (state.view, called) == (state.home, [])
