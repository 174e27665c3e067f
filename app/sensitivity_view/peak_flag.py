"""A flag in a plot that marks a peak and can be clicked."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPolygonF
from PySide6.QtWidgets import (
    QGraphicsObject,
    QGraphicsSceneMouseEvent,
    QStyleOptionGraphicsItem,
    QWidget,
)

from app import theme


class PeakFlag(QGraphicsObject):
    """A numbered flag at a peak of the responses, which can be clicked.

    Parameters
    ----------
    number : int
    color : str
    """

    clicked = Signal()

    def __init__(self, number: int, color: str) -> None:
        super().__init__()
        self.setFlag(QGraphicsObject.GraphicsItemFlag.ItemIgnoresTransformations)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setZValue(90)
        self._number, self._color = number, QColor(color)

    def boundingRect(self) -> QRectF:
        """Return the area of the flag in pixels."""
        return QRectF(-9, -2, 18, 22)

    def paint(
        self, painter: QPainter, _option: QStyleOptionGraphicsItem, _widget: QWidget | None = None
    ) -> None:
        """Draw a pointed label with the number."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(self._color)
        painter.drawRoundedRect(QRectF(-8, 0, 16, 14), 3, 3)
        painter.drawPolygon(QPolygonF([QPointF(-4, 13), QPointF(4, 13), QPointF(0, 19)]))
        painter.setPen(QColor(theme.BACKGROUND))
        painter.drawText(QRectF(-8, 0, 16, 14), Qt.AlignmentFlag.AlignCenter, str(self._number))

    def mousePressEvent(self, event: QGraphicsSceneMouseEvent) -> None:
        """Accept the press, so that the release arrives here."""
        event.accept()

    def mouseReleaseEvent(self, _event: QGraphicsSceneMouseEvent) -> None:
        """Emit the click."""
        self.clicked.emit()
