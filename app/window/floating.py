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
        """Have a widget float at the bottom, beside those that are there, or above them."""
        self._add("bottom", widget)

    def set_middle_of(self, widget: QWidget | None) -> None:
        """Put what floats at the bottom in the middle of a widget of the area; None: of all."""
        self._around = widget
        self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow the area's size, and the sizes of what floats."""
        resized = event.type() == QEvent.Type.Resize and watched is self._area
        if resized or event.type() in _PLACES:
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
        sizes = {widget: self._size_of(widget, area) for widget in self._shown("bottom")}
        in_row = sum(size.width() + GAP for size in sizes.values()) - GAP
        rows = [sizes] if in_row <= area.width() - 2 * SIDE else [{w: s} for w, s in sizes.items()]
        y = area.height() - BOTTOM
        for row in rows:
            y = self._place_row(row, y) - GAP

    def _place_row(self, row: dict[QWidget, QSize], bottom: int) -> int:
        """Place widgets beside each other, and return their upper edge."""
        width = sum(size.width() + GAP for size in row.values()) - GAP
        room, around = self._area.width() - SIDE - width, self._middle()
        middle = around.left() + (around.width() - width) // 2
        left = max(min(max(middle, SIDE), room), 0)
        top = bottom
        for widget, size in row.items():
            # On a low screen it may lie over the captions, but not beyond the area.
            upper = max(bottom - size.height(), 0)
            widget.setGeometry(left, upper, size.width(), size.height())
            left += size.width() + GAP
            top = min(top, upper)
        return top

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
