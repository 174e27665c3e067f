"""Changes of the view and the light by the mouse and by keys: orbit, roll, pan and zoom."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Literal, cast

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QNativeGestureEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from app.controls import ARROWS, CLICK_REACH
from app.engines.background import Pause
from app.state.view_navigation import ViewNavigation
from app.state.viewer_state import STEP_MS, ViewerState
from model.scene.orientation import angles_in, view_in
from model.scene.scene import LightDirection, LightRange
from model.scene.view import DEFAULT_UP, View

DEGREES_PER_PIXEL = 0.4
ZOOM_PER_NOTCH = 0.92
NEAREST, FARTHEST = 0.25, 1.5  # limits of the distance for zooming


def orbit(view: View, dx: float, dy: float, up: str = DEFAULT_UP) -> View:
    """Return the view turned about the up axis by a mouse movement in pixels, right and down."""
    azimuth, elevation, turned = angles_in(up, view)
    sin_r, cos_r = math.sin(math.radians(turned)), math.cos(math.radians(turned))
    across = dx * cos_r + dy * sin_r
    down = dy * cos_r - dx * sin_r
    azimuth = (azimuth - DEGREES_PER_PIXEL * across) % 360.0
    elevation = min(max(elevation + DEGREES_PER_PIXEL * down, -90.0), 90.0)
    return view_in(up, azimuth, elevation, turned, view)


def tumble(view: View, dx: float, dy: float) -> View:
    """Return the view turned about the image's own axes by a movement in pixels, right and down."""
    length = math.hypot(dx, dy)
    if length == 0.0:
        return view
    angle = math.radians(DEGREES_PER_PIXEL * length)
    # Rodrigues' formula, in the camera's right, up and back.
    x, y = dy / length, dx / length
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)
    return view.with_basis(turn @ view.basis())


def turn(state: ViewNavigation, dx: float, dy: float) -> View:
    """Return the state's view turned by a mouse movement in pixels."""
    if state.trackball:
        return state.turned(tumble(state.view, dx, dy))
    return state.turned(orbit(state.view, dx, dy, state.up_axis))


def roll(view: View, degrees: float) -> View:
    """Return the view with the image turned clockwise; the roll stays in -180..180."""
    return replace(view, roll=(view.roll + degrees + 180.0) % 360.0 - 180.0)


def pan(view: View, right: float, up: float) -> View:
    """Return the view with the picture moved, in halves of the image's shorter side."""
    return replace(view, pan_x=view.pan_x + right, pan_y=view.pan_y + up)


def zoom(view: View, notches: float, at: tuple[float, float] = (0.0, 0.0)) -> View:
    """Return the view moved closer by wheel notches, within the limits.

    A point of the plane through the volume's centre stays in place: it is given to the right and up
    from the image's middle, in halves of its shorter side.
    """
    # Line-like volumes are seen from nearer.
    nearest = min(NEAREST, view.distance)
    distance = min(max(view.distance * ZOOM_PER_NOTCH**notches, nearest), FARTHEST)
    grown = view.distance / distance
    (x, y), pan_x, pan_y = at, view.pan_x, view.pan_y
    return replace(
        view, distance=distance, pan_x=x + (pan_x - x) * grown, pan_y=y + (pan_y - y) * grown
    )


def notches_of(scale: float) -> float:
    """Return the wheel notches that enlarge the picture by a factor above 0."""
    return -math.log(scale) / math.log(ZOOM_PER_NOTCH)


def light_at(x: float, y: float, limits: LightRange) -> LightDirection:
    """Return the direction of a light perpendicular to a ball's surface, within limits."""
    length = max(1.0, math.hypot(x, y))
    x, y = x / length, y / length
    elevation = math.degrees(math.asin(min(max(y, -1.0), 1.0)))
    azimuth = math.degrees(math.atan2(x, math.sqrt(max(0.0, 1 - x * x - y * y))))
    return limits.nearest(LightDirection(azimuth, elevation))


WHEEL_REST_MS = 200  # pause after a wheel event that ends a zoom gesture
PIXELS_PER_NOTCH = 40.0  # scrolled pixels of a touchpad that count as a notch of a wheel
LEAST_PINCH = 0.1  # least factor of a step of a pinch: drivers may report nonsense
Gesture = Literal["turn", "roll", "pan", "light"]
OTHER_BUTTONS: dict[Qt.MouseButton, Gesture] = {
    Qt.MouseButton.RightButton: "roll",
    Qt.MouseButton.MiddleButton: "pan",
}
LEFT_BUTTON: dict[tuple[bool, bool], Gesture] = {
    (False, False): "turn", (True, False): "roll", (False, True): "pan", (True, True): "light",
}  # fmt: skip
"""Gestures by mouse button and whether Ctrl and Shift are down."""


class ViewGestures(QObject):
    """Changes a state's view, and its light, by mouse events on a widget.

    Left drag turns; right drag or Ctrl with left drag rolls; middle drag or Shift with left
    drag pans; the wheel and a pinch zoom to the cursor; a double click returns to the home
    view. Ctrl and Shift with left drag moves the light, where it is movable.
    """

    def __init__(self, widget: QWidget, state: ViewerState) -> None:
        super().__init__(widget)
        self._widget = widget
        self._state = state
        self._last = self._pressed = self._newest = QPointF()
        self._is_click = False
        self._gesture: Gesture | None = None
        self._button = Qt.MouseButton.NoButton
        self.light_range: LightRange | None = None  # limits of the light; None for the usual ones
        self._wheel_rest = Pause(self, WHEEL_REST_MS, state.finish_view)
        self._step_rest = Pause(self, STEP_MS, self._step)
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle the widget's mouse events; pass on all others."""
        kind = event.type()
        if kind == QEvent.Type.MouseButtonPress:
            return self._press(cast(QMouseEvent, event))
        if kind == QEvent.Type.MouseMove and self._gesture is not None:
            return self._move(cast(QMouseEvent, event))
        if kind == QEvent.Type.MouseButtonRelease and self._gesture is not None:
            return self._release(cast(QMouseEvent, event))
        if kind == QEvent.Type.MouseButtonDblClick:
            return self._double_click(cast(QMouseEvent, event))
        if kind == QEvent.Type.Wheel:
            return self._scroll(cast(QWheelEvent, event))
        if kind == QEvent.Type.NativeGesture:
            return self._pinch(cast(QNativeGestureEvent, event))
        return False

    def _press(self, event: QMouseEvent) -> bool:
        if self._gesture is not None:
            if event.button() != self._button and event.buttons() & self._button:
                # Another button during a drag changes nothing.
                return True
            # Another widget has taken the release.
            self._end_drag()
        self._gesture = self._gesture_of(event)
        if self._gesture is None:
            return False
        # The wheel's zoom was a gesture of its own.
        self._end_zoom()
        self._button = event.button()
        self._last = self._pressed = self._newest = event.position()
        self._is_click = self._gesture == "turn"
        if self._gesture == "light":
            self._drag(self._last)
        return True

    def _gesture_of(self, event: QMouseEvent) -> Gesture | None:
        button, keys = event.button(), event.modifiers()
        if button != Qt.MouseButton.LeftButton:
            return OTHER_BUTTONS.get(button)
        control = bool(keys & Qt.KeyboardModifier.ControlModifier)
        gesture = LEFT_BUTTON[control, bool(keys & Qt.KeyboardModifier.ShiftModifier)]
        return None if gesture == "light" and self._state.light is None else gesture

    def _release(self, event: QMouseEvent) -> bool:
        # Another event filter may have taken the awaited release.
        if event.button() == self._button or not event.buttons() & self._button:
            self._end_drag()
        return True

    def _move(self, event: QMouseEvent) -> bool:
        if not event.buttons() & self._button:
            # The release was kept from this widget.
            self._end_drag()
            return False
        if self._is_click:
            if (event.position() - self._pressed).manhattanLength() <= CLICK_REACH:
                return True
            self._is_click = False
        self._newest = event.position()
        if not self._step_rest.isActive():
            self._step()
        return True

    def _step(self) -> None:
        """Follow the mouse to where it is, if it has moved."""
        if self._newest != self._last:
            self._step_rest.start()
            self._drag(self._newest)

    def _end_drag(self) -> None:
        self._step()
        self._step_rest.stop()
        self._gesture = None
        self._state.finish_view()
        self._state.light_input.finish()

    def _double_click(self, event: QMouseEvent) -> bool:
        if event.button() != Qt.MouseButton.LeftButton or event.modifiers():
            # The second of two quick drags.
            return self._press(event)
        self._end_zoom()
        self._state.reset_view()
        return True

    def _drag(self, position: QPointF) -> None:
        last, self._last = self._last, position
        moved = position - last
        state = self._state
        if self._gesture == "turn":
            state.move_view(turn(state, moved.x(), moved.y()))
        elif self._gesture == "pan":
            _, half = self._frame()
            state.move_view(pan(state.view, moved.x() / half, -moved.y() / half))
        elif self._gesture == "roll":
            turned = self._bearing(position) - self._bearing(last)
            state.move_view(roll(state.view, (turned + 180.0) % 360.0 - 180.0))
        elif state.light is not None:
            x, y = self._place(position)
            state.light_input.move(light_at(x, y, self.light_range or LightRange()))

    def _scroll(self, event: QWheelEvent) -> bool:
        # Wheels of high resolution report parts of a notch; some touchpads only pixels.
        notches = event.angleDelta().y() / 120
        if event.angleDelta().isNull():
            notches = event.pixelDelta().y() / PIXELS_PER_NOTCH
        self._zoom(notches, event.position())
        return True

    def _pinch(self, event: QNativeGestureEvent) -> bool:
        kind = event.gestureType()
        if kind == Qt.NativeGestureType.ZoomNativeGesture:
            self._zoom(notches_of(max(1.0 + event.value(), LEAST_PINCH)), event.position())
        elif kind == Qt.NativeGestureType.EndNativeGesture:
            self._end_zoom()
        else:
            return kind == Qt.NativeGestureType.BeginNativeGesture
        return True

    def _zoom(self, notches: float, position: QPointF) -> None:
        if notches:
            self._state.move_view(zoom(self._state.view, notches, self._place(position)))
            if self._gesture is None:
                self._wheel_rest.start()

    def _end_zoom(self) -> None:
        if self._wheel_rest.isActive():
            self._wheel_rest.stop()
            self._state.finish_view()

    def _frame(self) -> tuple[QPointF, float]:
        """Middle and half the side of the largest square in the image, or in the whole widget."""
        frame = QRectF(getattr(self._widget, "image_rect", self._widget.rect()))
        return frame.center(), max(min(frame.width(), frame.height()) / 2, 1.0)

    def _place(self, position: QPointF) -> tuple[float, float]:
        """A position to the right and up from the image's middle, in halves of its side."""
        middle, half = self._frame()
        arm = position - middle
        return arm.x() / half, -arm.y() / half

    def _bearing(self, position: QPointF) -> float:
        """Clockwise angle of a position about the volume's centre in the image, in degrees."""
        x, y = self._place(position)
        view = self._state.view
        return math.degrees(math.atan2(view.pan_y - y, x - view.pan_x))


DEGREES, FINE_DEGREES = 5.0, 1.0  # step of a turn or roll, and with Shift
PAN_STEP, FINE_PAN_STEP = 0.1, 0.02  # in halves of the shorter side; with Shift

NOTCHES: dict[int, int] = {Qt.Key.Key_Plus: 1, Qt.Key.Key_Equal: 1, Qt.Key.Key_Minus: -1}
ROLLS: dict[int, int] = {Qt.Key.Key_PageUp: -1, Qt.Key.Key_PageDown: 1}  # clockwise turns


class ViewKeys(QObject):
    """Changes a state's view by the keys of a widget; a click, the wheel and Tab focus it."""

    def __init__(self, widget: QWidget, state: ViewerState) -> None:
        super().__init__(widget)
        self._state = state
        self._held: set[int] = set()
        widget.setFocusPolicy(Qt.FocusPolicy.WheelFocus)
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle the keys of the view; pass on all others."""
        kind = event.type()
        if kind == QEvent.Type.ShortcutOverride and self._step(cast(QKeyEvent, event)):
            # The image has the focus, so it gets the key before the window's shortcuts.
            event.accept()
            return True
        if kind == QEvent.Type.KeyPress:
            return self._press(cast(QKeyEvent, event))
        if kind == QEvent.Type.KeyRelease:
            return self._release(cast(QKeyEvent, event))
        if kind in (QEvent.Type.FocusOut, QEvent.Type.Hide) and self._held:
            # The release goes to another widget.
            self._held.clear()
            self._state.finish_view()
        return False

    def _press(self, event: QKeyEvent) -> bool:
        change = self._step(event)
        if change is None:
            return False
        self._held.add(_place_of(event))
        self._state.move_view(change())
        return True

    def _release(self, event: QKeyEvent) -> bool:
        place = _place_of(event)
        if place not in self._held:
            return False
        if not event.isAutoRepeat():
            self._held.remove(place)
            if not self._held:
                self._state.finish_view()
        return True

    def _step(self, event: QKeyEvent) -> Callable[[], View] | None:
        """Change of a key, with its modifiers; None for others."""
        # The numeric keypad's keys count as the others.
        keys = event.modifiers() & ~Qt.KeyboardModifier.KeypadModifier
        fine = bool(keys & Qt.KeyboardModifier.ShiftModifier)
        control = bool(keys & Qt.KeyboardModifier.ControlModifier)
        if keys & ~(Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier):
            return None
        state, key = self._state, event.key()
        if key in ARROWS:
            right, down = ARROWS[key]
            if control:
                length = FINE_PAN_STEP if fine else PAN_STEP
                return partial(pan, state.view, length * right, -length * down)
            pixels = (FINE_DEGREES if fine else DEGREES) / DEGREES_PER_PIXEL
            return partial(turn, state, pixels * right, pixels * down)
        if control:
            return None
        if key in NOTCHES:
            return partial(zoom, state.view, NOTCHES[key])
        if key in ROLLS:
            degrees = ROLLS[key] * (FINE_DEGREES if fine else DEGREES)
            return partial(roll, state.view, degrees)
        return (lambda: state.home) if key == Qt.Key.Key_Home else None


def _place_of(event: QKeyEvent) -> int:
    """Physical key: without Shift, the same key may have another name."""
    return event.nativeScanCode() or event.key()
