"""Mouse gestures that change the view: orbit, roll, pan and zoom; and one for the light."""

from __future__ import annotations

import math
from typing import Literal, cast

from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, Qt, QTimer
from PySide6.QtGui import QMouseEvent, QNativeGestureEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from app.image_view.light_ball import light_at
from app.image_view.view_steps import notches_of, pan, roll, turn, zoom
from app.state.viewer_state import ViewerState
from model.scene.light import LightRange

CLICK_REACH = 4.0
"""Largest movement of a click, in pixels; a drag turns the view only beyond it."""

WHEEL_REST_MS = 200
"""Pause after a wheel event that ends a zoom gesture."""

PIXELS_PER_NOTCH = 40.0
"""Scrolled pixels of a touchpad that count as a notch of a wheel."""

LEAST_PINCH = 0.1
"""Least factor of a single step of a pinch, whose drivers may report nonsense."""

Gesture = Literal["turn", "roll", "pan", "light"]


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
        self._last = self._pressed = QPointF()
        self._is_click = False
        self._gesture: Gesture | None = None
        self._button = Qt.MouseButton.NoButton
        self._limits = LightRange()
        self._wheel_rest = QTimer(self, singleShot=True, interval=WHEEL_REST_MS)
        self._wheel_rest.timeout.connect(state.finish_view)
        widget.installEventFilter(self)

    def set_light_range(self, limits: LightRange | None) -> None:
        """Set the limits of the light's direction; None for the usual ones."""
        self._limits = limits or LightRange()

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
            # The release was kept from this widget.
            self._end_drag()
        self._gesture = self._gesture_of(event)
        if self._gesture is None:
            return False
        # What the wheel did is a gesture of its own.
        self._end_zoom()
        self._button = event.button()
        self._last = self._pressed = event.position()
        self._is_click = self._gesture == "turn"
        if self._gesture == "light":
            self._drag(self._last)
        return True

    def _gesture_of(self, event: QMouseEvent) -> Gesture | None:
        """The gesture that a press begins; None if there is none."""
        if event.button() == Qt.MouseButton.RightButton:
            return "roll"
        if event.button() == Qt.MouseButton.MiddleButton:
            return "pan"
        if event.button() != Qt.MouseButton.LeftButton:
            return None
        control = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        if control and shift:
            return None if self._state.light is None else "light"
        if control or shift:
            return "roll" if control else "pan"
        return "turn"

    def _release(self, event: QMouseEvent) -> bool:
        # What handles events before may have kept the release that was waited for.
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
        self._drag(event.position())
        return True

    def _end_drag(self) -> None:
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
            state.light_input.move(light_at(x, y, self._limits))

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
