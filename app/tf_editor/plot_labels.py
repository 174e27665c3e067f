"""Numbers next to the plots, without a line, ticks or a title: their tooltip says what they are."""

from __future__ import annotations

from typing import Literal

from PySide6.QtCore import QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter
from PySide6.QtWidgets import (
    QApplication,
    QGraphicsItem,
    QGraphicsWidget,
    QStyleOptionGraphicsItem,
    QWidget,
)

Side = Literal["left", "bottom", "right"]

LABEL_PIXELS = 11
"""Height of the numbers' type."""

GAP = 7
"""Pixels between a number and the plot at its side."""

APART = 14
"""Least distance of two numbers from one another, in pixels."""

NEAR_GAP = 4
"""Pixels between the plot and a number at its right, where little room is left."""

OVERHANG = 44
"""Pixels by which numbers at the ends may reach beyond the plot."""


def label_font() -> QFont:
    """Return the font of the numbers in and next to the plots."""
    font = QFont(QApplication.font())
    font.setPixelSize(LABEL_PIXELS)
    return font


class PlotLabels(QGraphicsWidget):
    """Numbers along one side of a plot, each at its place."""

    def __init__(self, side: Side) -> None:
        super().__init__()
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)
        self._side = side
        self._color = QColor()
        self.labels: tuple[tuple[float, str], ...] = ()
        """Places along the side, from 0 at the left or bottom to 1, and numbers."""

    def set_labels(self, labels: list[tuple[float, str]], color: str) -> None:
        """Show other numbers, or in another colour."""
        self.labels, self._color = tuple(labels), QColor(color)
        self.update()

    def boundingRect(self) -> QRectF:
        """Return the area of all numbers, in pixels."""
        return QRectF(QPointF(), QSizeF(self.size())).adjusted(-OVERHANG, -8, OVERHANG, 8)

    def boxes(self) -> list[tuple[QRectF, str]]:
        """Return where the numbers stand, in the item's pixels: those that overlap none before."""
        metrics = QFontMetricsF(label_font())
        found: list[tuple[QRectF, str]] = []
        # Those at the ends first: they say what is shown.
        ends = self.labels[:1] + self.labels[-1:]
        for place, text in (*ends, *self.labels[1:-1]):
            box = self._box(place, metrics.horizontalAdvance(text), metrics.height())
            if not any(box.adjusted(-APART, 0, APART, 0).intersects(other) for other, _ in found):
                found.append((box, text))
        return found

    def paint(
        self, painter: QPainter, _option: QStyleOptionGraphicsItem, _widget: QWidget | None = None
    ) -> None:
        """Write the numbers."""
        painter.setFont(label_font())
        painter.setPen(self._color)
        for box, text in self.boxes():
            painter.drawText(box.adjusted(-2, 0, 2, 0), Qt.AlignmentFlag.AlignCenter, text)

    def _box(self, place: float, width: float, height: float) -> QRectF:
        size = self.size()
        if self._side == "bottom":
            # The unit makes the last one long: it ends where the window does.
            left = min(place * size.width() - width / 2, size.width() + OVERHANG - GAP - width)
            return QRectF(left, 2, width, height)
        y = (1.0 - place) * size.height() - height / 2
        left = size.width() - GAP - width if self._side == "left" else NEAR_GAP
        return QRectF(left, y, width, height)
