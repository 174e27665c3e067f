"""A small ball widget for moving the light."""

from __future__ import annotations

import math

from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QRadialGradient
from PySide6.QtWidgets import QWidget

from app import theme
from app.state.viewer_state import ViewerState
from model.scene.light import LightDirection, LightRange

DIAMETER = 30


def light_at(x: float, y: float, limits: LightRange) -> LightDirection:
    """Return the direction of a light perpendicular to a ball's surface at a point.

    Parameters
    ----------
    x, y : float
        Offset to the right and up from the ball's centre, in radii; points outside are
        moved to the rim. Directions are clamped to the limits.
    """
    length = max(1.0, math.hypot(x, y))
    x, y = x / length, y / length
    elevation = math.degrees(math.asin(min(max(y, -1.0), 1.0)))
    azimuth = math.degrees(math.atan2(x, math.sqrt(max(0.0, 1 - x * x - y * y))))
    return LightDirection(
        min(max(azimuth, -limits.max_azimuth), limits.max_azimuth),
        min(max(elevation, -limits.max_elevation), limits.max_elevation),
    )


class LightBall(QWidget):
    """Shows the light's direction, which can be changed by dragging.

    Initially hidden; shown only if the light is movable.

    Parameters
    ----------
    state : ViewerState
    """

    def __init__(self, state: ViewerState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self._limits = LightRange()
        self.setFixedSize(QSize(DIAMETER, DIAMETER))
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setToolTip("Drag to move the light; double-click for the light from the upper left")
        state.lightChanged.connect(self.update)
        self.hide()

    def set_range(self, limits: LightRange | None) -> None:
        """Offer the light within a range, or hide where there is none."""
        self._limits = limits or LightRange()
        self.setVisible(limits is not None)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Move the light to the mouse's position."""
        self._move(event.position())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the light with the mouse."""
        self._move(event.position())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the movement, which requests the final images."""
        self._state.finish_light()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Return to the default direction."""
        self._state.set_light(LightDirection())

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint a ball with a highlight in the light's direction."""
        light = self._state.light or LightDirection()
        right, up, _ = light.towards()
        middle, radius = QPointF(DIAMETER / 2, DIAMETER / 2), DIAMETER / 2 - 1
        spot = middle + QPointF(right, -up) * (0.85 * radius)
        shade = QRadialGradient(middle, radius, spot)
        shade.setColorAt(0.0, QColor(theme.TEXT))
        shade.setColorAt(1.0, QColor(theme.CANVAS))
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(theme.DIM_TEXT))
        painter.setBrush(shade)
        painter.drawEllipse(middle, radius, radius)
        painter.end()

    def _move(self, position: QPointF) -> None:
        radius = DIAMETER / 2
        self._state.move_light(
            light_at(position.x() / radius - 1, 1 - position.y() / radius, self._limits)
        )
