"""A small draggable mark on a plot."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

from PySide6.QtCore import QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF
from PySide6.QtWidgets import (
    QGraphicsItem,
    QGraphicsObject,
    QGraphicsSceneContextMenuEvent,
    QGraphicsSceneHoverEvent,
    QGraphicsSceneMouseEvent,
    QStyleOptionGraphicsItem,
    QWidget,
)

from app import theme

Shape = Literal["circle", "square", "pin", "line"]

_RADIUS = {"circle": 6.0, "square": 4.0, "pin": 6.0, "line": 0.0}
_REACH = 12.0
"""Half the edge of the square that reacts to the mouse, in pixels; larger than the mark."""

_ADDING = Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier


class DragHandle(QGraphicsObject):
    """A draggable mark of constant size in pixels, placed in the plot's coordinates.

    It does not move by itself: it calls its owner's functions, which move it.

    Attributes
    ----------
    adds : bool
        Whether it was pressed with Shift or Ctrl, to be selected with others.
    """

    def __init__(
        self,
        shape: Shape,
        drag: Callable[[float, float], object],
        release: Callable[[], object],
        press: Callable[[], object] = lambda: None,
        menu: Callable[[QPoint], object] = lambda _point: None,
        double_click: Callable[[], object] = lambda: None,
    ) -> None:
        super().__init__()
        self.setFlag(QGraphicsItem.GraphicsItemFlag.ItemIgnoresTransformations)
        # While one of them is dragged, the others are only copied.
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)
        self.setAcceptHoverEvents(True)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self._shape = shape
        self._drag, self._release, self._press = drag, release, press
        self.menu, self._double_click = menu, double_click
        self._look = QColor(theme.CURVE), False, False
        self._hovered = False
        self._grip: QPointF | None = None
        self.adds = False

    def set_look(self, fill: QColor, selected: bool, *, ringed: bool | None = None) -> None:
        """Set the fill colour, and highlight the handle if it is selected.

        A ring around it says that keys act on it; by default, all selected ones but squares
        have it.
        """
        if ringed is None:
            ringed = selected and self._shape != "square"
        if self._look != (fill, selected, ringed):
            self._look = fill, selected, ringed
            self.setZValue(101 if selected else 100)
            self.update()

    @property
    def is_mark(self) -> bool:
        """True for a mark on a curve; False for a line."""
        return self._shape != "line"

    @property
    def is_hovered(self) -> bool:
        """True while the mouse is over the handle."""
        return self._hovered

    def boundingRect(self) -> QRectF:
        """Return the area that is painted and reacts to the mouse, in pixels."""
        return QRectF(-_REACH, -_REACH, 2 * _REACH, 2 * _REACH)

    def paint(
        self, painter: QPainter, _option: QStyleOptionGraphicsItem, _widget: QWidget | None = None
    ) -> None:
        """Draw the mark, with a ring around the selected one."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        radius = _RADIUS[self._shape] + (1.0 if self._hovered else 0.0)
        fill, _selected, ringed = self._look
        if ringed:
            painter.setPen(QPen(QColor(theme.ACCENT), 2.0))
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawEllipse(QPointF(), radius + 3.5, radius + 3.5)
        painter.setPen(QPen(QColor(theme.PLOT), 1.0))
        painter.setBrush(QColor(theme.CURVE))
        self._draw(painter, radius)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(fill)
        self._draw(painter, radius - 1.6)

    def _draw(self, painter: QPainter, radius: float) -> None:
        if self._shape == "square":
            painter.drawRect(QRectF(-radius, -radius, 2 * radius, 2 * radius))
        elif self._shape == "pin":
            roof = (QPointF(-radius, 0), QPointF(0, -radius), QPointF(radius, 0))
            foot = (QPointF(radius, radius), QPointF(-radius, radius))
            painter.drawPolygon(QPolygonF([*roof, *foot]))
        else:
            painter.drawEllipse(QPointF(), radius, radius)

    def mousePressEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Select, and begin a drag with the left button."""
        self.adds = bool(event.modifiers() & _ADDING)
        self._press()
        if event.button() == Qt.MouseButton.LeftButton:
            # Keep the offset between mouse and mark, so that the mark does not jump.
            self._grip = self.pos() - self._plot_position(event)
        event.accept()

    def mouseMoveEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Say where the mark is dragged to."""
        if self._grip is not None:
            wanted = self._plot_position(event) + self._grip
            self._drag(wanted.x(), wanted.y())

    def mouseReleaseEvent(self, _event: QGraphicsSceneMouseEvent) -> None:
        """End the drag."""
        if self._grip is not None:
            self._grip = None
            self._release()

    def mouseDoubleClickEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Pass on the double click."""
        event.accept()
        self._double_click()

    def contextMenuEvent(self, event: QGraphicsSceneContextMenuEvent) -> None:
        """Open the mark's menu."""
        event.accept()
        self.menu(event.screenPos())

    def hoverEnterEvent(self, _event: QGraphicsSceneHoverEvent) -> None:
        """Enlarge the mark slightly under the mouse."""
        self._hovered = True
        self.update()

    def hoverLeaveEvent(self, _event: QGraphicsSceneHoverEvent) -> None:
        """Restore the mark's size."""
        self._hovered = False
        self.update()

    def _plot_position(self, event: QGraphicsSceneMouseEvent) -> QPointF:
        return self.parentItem().mapFromScene(event.scenePos())
