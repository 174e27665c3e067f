"""What floats over the images: notices at the top, cards at the bottom; nothing moves for them."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QRect, QSize
from PySide6.QtWidgets import QWidget

TOP, BOTTOM = 40, 44
"""Distance to the upper edge, below the captions, and to the lower one, above the colour bars."""

SIDE, GAP = 8, 8
"""Least distance to the other edges, and between two, in pixels."""

_PLACES = {
    QEvent.Type.Show,
    QEvent.Type.Hide,
    QEvent.Type.LayoutRequest,
    QEvent.Type.ShowToParent,
    QEvent.Type.HideToParent,
}
"""Events after which something has another size, or is there or gone."""


class Floating(QObject):
    """Keeps widgets over an area in their places, each as large as it must be.

    Parameters
    ----------
    area : QWidget
        Its widgets below the floating ones keep their places.
    """

    def __init__(self, area: QWidget) -> None:
        super().__init__(area)
        self._area = area
        self._columns: dict[str, list[QWidget]] = {"top": [], "bottom": []}
        self._around: QWidget | None = None
        area.installEventFilter(self)

    def add_top(self, widget: QWidget) -> None:
        """Have a widget float at the top, below those that are there."""
        self._add("top", widget)

    def add_bottom(self, widget: QWidget) -> None:
        """Have a widget float at the bottom, above those that are there."""
        self._add("bottom", widget)

    def set_middle_of(self, widget: QWidget | None) -> None:
        """Put what floats at the bottom in the middle of a widget of the area; None: of all."""
        self._around = widget
        self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the area's size, and the sizes of what floats."""
        resized = event.type() == QEvent.Type.Resize and watched is self._area
        if resized or (event.type() in _PLACES and watched is not self._area):
            self._place()
        return False

    def _add(self, column: str, widget: QWidget) -> None:
        hidden = widget.isHidden()
        widget.setParent(self._area)
        # A new parent hides what it is given.
        widget.setVisible(not hidden)
        widget.installEventFilter(self)
        self._columns[column].append(widget)
        self._place()

    def _place(self) -> None:
        area = self._area.rect()
        y = TOP
        for widget in self._shown("top"):
            size = self._size_of(widget, area)
            widget.setGeometry((area.width() - size.width()) // 2, y, size.width(), size.height())
            y += size.height() + GAP
        middle = self._middle().center().x()
        y = area.height() - BOTTOM
        for widget in self._shown("bottom"):
            size = self._size_of(widget, area)
            left = min(max(middle - size.width() // 2, SIDE), area.width() - SIDE - size.width())
            # On a low screen it may lie over the captions, but not beyond the area.
            top = max(y - size.height(), 0)
            widget.setGeometry(max(left, 0), top, size.width(), size.height())
            y = top - GAP

    def _shown(self, column: str) -> list[QWidget]:
        widgets = [widget for widget in self._columns[column] if not widget.isHidden()]
        for widget in widgets:
            widget.raise_()
        return widgets

    def _size_of(self, widget: QWidget, area: QRect) -> QSize:
        width = min(widget.sizeHint().width(), area.width() - 2 * SIDE)
        high = widget.heightForWidth(width) if widget.hasHeightForWidth() else -1
        return QSize(width, high if high >= 0 else widget.sizeHint().height())

    def _middle(self) -> QRect:
        around = self._around
        if around is None or around.isHidden():
            return self._area.rect()
        return QRect(around.mapTo(self._area, around.rect().topLeft()), around.size())
