"""Mouse gestures that change the view: orbit, roll and zoom.

Pure functions compute the views; :class:`ViewGestures` applies them to a widget's
mouse events.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import cast

from PySide6.QtCore import QEvent, QObject, QPointF, Qt, QTimer
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from app.state.viewer_state import HOME_VIEW, ViewerState
from model.scene.view import View

DEGREES_PER_PIXEL = 0.4
ZOOM_PER_NOTCH = 0.92
NEAREST, FARTHEST = 0.25, 1.5
"""Limits of the distance for zooming."""

WHEEL_REST_MS = 200
"""Pause after a wheel event that ends a zoom gesture."""


def orbit(view: View, dx: float, dy: float) -> View:
    """Return the view after orbiting the volume by a mouse movement.

    Parameters
    ----------
    view : View
    dx, dy : float
        Movement of the mouse in pixels, to the right and down.
    """
    sin_r, cos_r = math.sin(math.radians(view.roll)), math.cos(math.radians(view.roll))
    across = dx * cos_r + dy * sin_r
    down = dy * cos_r - dx * sin_r
    elevation = view.elevation + DEGREES_PER_PIXEL * down
    return replace(
        view,
        azimuth=(view.azimuth - DEGREES_PER_PIXEL * across) % 360.0,
        elevation=min(max(elevation, -90.0), 90.0),
    )


def roll(view: View, degrees: float) -> View:
    """Return the view with the image turned clockwise; the roll stays in -180..180."""
    return replace(view, roll=(view.roll + degrees + 180.0) % 360.0 - 180.0)


def zoom(view: View, notches: float) -> View:
    """Return the view moved closer by wheel notches, within the limits; negative moves away."""
    distance = view.distance * ZOOM_PER_NOTCH**notches
    return replace(view, distance=min(max(distance, NEAREST), FARTHEST))


class ViewGestures(QObject):
    """Changes a state's view by mouse events on a widget.

    Left drag orbits, right drag or Ctrl with left drag rolls, the wheel zooms,
    and a double click returns to the home view.
    """

    def __init__(self, widget: QWidget, state: ViewerState) -> None:
        super().__init__(widget)
        self._widget = widget
        self._state = state
        self._last: QPointF | None = None
        self._rolling = False
        self._wheel_rest = QTimer(self, singleShot=True, interval=WHEEL_REST_MS)
        self._wheel_rest.timeout.connect(state.finish_view)
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Handle the widget's mouse events; pass on all others."""
        kind = event.type()
        if kind == QEvent.Type.MouseButtonPress:
            return self._press(cast(QMouseEvent, event))
        if kind == QEvent.Type.MouseMove and self._last is not None:
            return self._drag(cast(QMouseEvent, event).position())
        if kind == QEvent.Type.MouseButtonRelease and self._last is not None:
            self._last = None
            self._state.finish_view()
            return True
        if kind == QEvent.Type.MouseButtonDblClick:
            self._state.set_view(HOME_VIEW)
            return True
        if kind == QEvent.Type.Wheel:
            notches = cast(QWheelEvent, event).angleDelta().y() / 120
            self._state.move_view(zoom(self._state.view, notches))
            self._wheel_rest.start()
            return True
        return False

    def _press(self, event: QMouseEvent) -> bool:
        left = event.button() == Qt.MouseButton.LeftButton
        right = event.button() == Qt.MouseButton.RightButton
        if not (left or right):
            return False
        control = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        self._rolling = right or control
        self._last = event.position()
        return True

    def _drag(self, position: QPointF) -> bool:
        assert self._last is not None
        last, self._last = self._last, position
        view = self._state.view
        if self._rolling:
            turned = self._bearing(position) - self._bearing(last)
            self._state.move_view(roll(view, (turned + 180.0) % 360.0 - 180.0))
        else:
            moved = position - last
            self._state.move_view(orbit(view, moved.x(), moved.y()))
        return True

    def _bearing(self, position: QPointF) -> float:
        """Clockwise angle of a position about the widget's centre, in degrees."""
        arm = position - QPointF(self._widget.rect().center())
        return math.degrees(math.atan2(arm.y(), arm.x()))
