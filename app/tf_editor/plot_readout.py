"""Numbers next to the mouse during a drag in the plots."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QObject, QPoint, Qt, Signal
from PySide6.QtWidgets import QLabel

GAP = 18
"""Pixels between a point and its numbers."""


class PlotReadout(QObject):
    """Shows numbers over the plots, next to a point.

    Parameters
    ----------
    widget : pyqtgraph.GraphicsLayoutWidget
        The widget with the plots.
    """

    changed = Signal()
    """Emitted when the numbers appear or go."""

    def __init__(self, widget: Any, parent: QObject) -> None:
        super().__init__(parent)
        self._widget = widget
        self._label = QLabel(widget)
        self._label.setProperty("role", "readout")
        self._label.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._label.hide()

    @property
    def text(self) -> str:
        """The numbers; empty where none are shown."""
        return "" if self._label.isHidden() else self._label.text()

    def show_at(self, at: QPoint, text: str) -> None:
        """Show numbers next to a pixel of the widget, on the side where there is room."""
        label, widget = self._label, self._widget
        label.setText(text)
        label.adjustSize()
        size = label.size()
        on_right = at.x() < widget.width() / 2
        x = at.x() + GAP if on_right else at.x() - GAP - size.width()
        y = min(max(at.y() - size.height() // 2, 0), widget.height() - size.height())
        label.move(x, y)
        if label.isHidden():
            label.show()
            self.changed.emit()

    def hide(self) -> None:
        """Hide the numbers again."""
        if not self._label.isHidden():
            self._label.hide()
            self.changed.emit()
