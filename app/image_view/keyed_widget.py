"""A widget with a ring where keys have brought the focus, and the steps of its arrow keys."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFocusEvent, QPainter, QPen
from PySide6.QtWidgets import QWidget

from app import theme
from app.controls import BY_KEYS

ARROWS: dict[int, tuple[int, int]] = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, -1),
    Qt.Key.Key_Down: (0, 1),
}
"""Steps to the right and down of arrow keys."""


class KeyedWidget(QWidget):
    """A widget that paints itself, and a ring around it if keys have brought the focus to it."""

    _is_ringed = False

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show a ring around what keys have brought the focus to."""
        self._is_ringed = event.reason() in BY_KEYS
        self.update()
        super().focusInEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        """Show no ring any more."""
        self._is_ringed = False
        self.update()
        super().focusOutEvent(event)

    def _paint_ring(self, painter: QPainter) -> None:
        """Paint the ring, if there is one; to be called last of all that is painted."""
        if self._is_ringed:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(theme.ON_IMAGE.change), 2))
            painter.drawRect(self.rect().adjusted(1, 1, -1, -1))
