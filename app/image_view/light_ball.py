"""A small ball widget for moving the light."""

from __future__ import annotations

import math

from PySide6.QtCore import QPointF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QRadialGradient
from PySide6.QtWidgets import QWidget

from app import theme
from app.state.viewer_state import ViewerState
from model.scene.light import LightDirection, LightRange

DIAMETER = 20

REACH = 60.0
"""Pixels that a drag moves the light by the ball's radius."""

CLICK_REACH = 2.0
"""Largest movement of a click, in pixels."""

MOVABLE = (
    "Drag to move the light, click to aim it, double-click for light from the upper left. In an "
    "image: Ctrl+Shift and drag."
)
FIXED = (
    "The light is fixed, as the open model was trained with it. Close the model to move the light."
)


def light_at(x: float, y: float, limits: LightRange) -> LightDirection:
    """Return the direction of a light perpendicular to a ball's surface, within limits.

    The point is to the right and up from the ball's centre, in radii; outside, it is moved to
    the rim.
    """
    length = max(1.0, math.hypot(x, y))
    x, y = x / length, y / length
    elevation = math.degrees(math.asin(min(max(y, -1.0), 1.0)))
    azimuth = math.degrees(math.atan2(x, math.sqrt(max(0.0, 1 - x * x - y * y))))
    return limits.nearest(LightDirection(azimuth, elevation))


class LightBall(QWidget):
    """Shows the light's direction, which can be changed by dragging, or by a click.

    A drag moves the light by more pixels than the ball has, so that a hand can set it. Where a
    model was trained with a fixed light, the ball is there but cannot be moved; without light,
    it is hidden.
    """

    def __init__(self, state: ViewerState, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._state = state
        self._fixed = LightDirection()
        self._limits = LightRange()
        self._pressed = QPointF()
        self._start: tuple[float, float] | None = None
        self._moved = False
        self.setFixedSize(QSize(DIAMETER, DIAMETER))
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.setAccessibleName("Light direction")
        # What stands next to it keeps its place.
        policy = self.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.setSizePolicy(policy)
        state.light_input.changed.connect(self.update)
        self.set_light(None, None)

    def set_light(self, light: LightDirection | None, limits: LightRange | None) -> None:
        """Offer a light within a range: no light hides the ball, no limits fix it."""
        self._fixed = light or LightDirection()
        self._limits = limits or LightRange()
        self.setVisible(light is not None)
        self.setEnabled(limits is not None)
        self.setToolTip(MOVABLE if limits is not None else FIXED)
        self.update()

    @property
    def direction(self) -> LightDirection:
        """Direction of the light that is shown."""
        return self._state.light or self._fixed

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin a drag, or a click."""
        right, up, _ = self.direction.towards()
        self._pressed, self._start, self._moved = event.position(), (right, up), False

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the light with the mouse."""
        moved = event.position() - self._pressed
        if self._start is None or (not self._moved and moved.manhattanLength() <= CLICK_REACH):
            return
        self._moved = True
        x, y = self._start
        self._state.light_input.move(
            light_at(x + moved.x() / REACH, y - moved.y() / REACH, self._limits)
        )

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End the movement, which requests the final images; a click puts the light there."""
        if self._start is not None and not self._moved:
            radius, at = DIAMETER / 2, event.position()
            self._state.light_input.move(
                light_at(at.x() / radius - 1, 1 - at.y() / radius, self._limits)
            )
        self._start = None
        self._state.light_input.finish()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Return to the default direction."""
        self._start = None
        self._state.light_input.set(self._limits.nearest(LightDirection()))

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint a ball with a highlight in the light's direction."""
        right, up, _ = self.direction.towards()
        middle, radius = QPointF(DIAMETER / 2, DIAMETER / 2), DIAMETER / 2 - 1
        spot = middle + QPointF(right, -up) * (0.85 * radius)
        shade = QRadialGradient(middle, radius, spot)
        # A lit ball looks alike in both themes.
        lit = theme.ON_IMAGE.text if self.isEnabled() else theme.ON_IMAGE.disabled
        shade.setColorAt(0.0, QColor(lit))
        shade.setColorAt(1.0, QColor(theme.CANVAS))
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QColor(theme.DIM_TEXT if self.isEnabled() else theme.FAINT_TEXT))
        painter.setBrush(shade)
        painter.drawEllipse(middle, radius, radius)
        painter.end()
