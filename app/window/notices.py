"""Notices and cards, which float over the images."""

from __future__ import annotations

from functools import partial
from typing import Literal

from PySide6.QtCore import QEvent, QObject, QPoint, QPointF, QRect, QSize, Qt
from PySide6.QtGui import QKeySequence, QMouseEvent, QShortcut
from PySide6.QtWidgets import QApplication, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app import theme
from app.controls import Action, Card, action_button, announce, fill, label, order_focus
from app.icons import IconButton

WIDTH = 480  # largest width of a notice, as longer lines are hard to read
MOST_SHOWN, MOST_KEPT = 3, 20  # notices shown at once; and kept until there is room

NoticeTone = Literal["plain", "error"]


class Notices(QWidget):
    """Lists notices, newest first, until the user dismisses them; hidden without any."""

    def __init__(self) -> None:
        super().__init__()
        self._lines: list[_Line] = []
        self.image: QWidget | None = None  # which has the focus after the last notice
        self.before: QWidget | None = None  # from which Tab goes to later notices
        self._column = fill(QVBoxLayout(self), spacing=4)
        self.more = label("", "dim")
        self.more.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self.more.setStyleSheet(f"color: {theme.ON_IMAGE.text}")
        self._column.addWidget(self.more)
        self.more.hide()
        self.hide()

    @property
    def text(self) -> str:
        """The sentences, one per line, newest first."""
        return "\n".join(line.text for line in self._lines)

    def add(self, text: str, *actions: Action, key: str = "", tone: NoticeTone = "plain") -> None:
        """Show a notice above the others; it replaces one with the same text or key."""
        for line in [*self._lines]:
            if line.text == text or (key and line.key == key):
                self._remove(line)
        if not text:
            return
        line = _Line(text, key, tone)
        buttons: list[QWidget] = [action_button(a, partial(self._remove, line)) for a in actions]
        buttons.append(line.dismissal)
        line.dismissal.clicked.connect(partial(self._remove, line))
        escape = QShortcut(QKeySequence("Escape"), line, partial(self._remove, line))
        escape.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        self._lines.insert(0, line)
        self._column.insertWidget(0, line)
        for button in buttons:
            line.row.addWidget(button)
        if self.before is not None:
            # Otherwise Tab would reach them after the rest of the window.
            order_focus([self.before, *buttons])
        for old in self._lines[MOST_KEPT:]:
            self._remove(old)
        self._show()
        announce(self, text, at_once=tone == "error")

    def clear(self, key: str = "") -> None:
        """Remove the notice with a key, or all notices."""
        for line in [*self._lines]:
            if not key or line.key == key:
                self._remove(line)

    def dismiss_newest(self) -> bool:
        """Remove the first notice; return False if there is none."""
        if self._lines:
            self._remove(self._lines[0])
            return True
        return False

    def sizeHint(self) -> QSize:
        """Return the size of notices of the usual width."""
        return QSize(WIDTH, self._column.heightForWidth(WIDTH))

    def minimumSizeHint(self) -> QSize:
        """Take any width."""
        return QSize(0, 0)

    def _show(self) -> None:
        """Show the newest notices, and the number of the others."""
        for place, line in enumerate(self._lines):
            line.setVisible(place < MOST_SHOWN)
        hidden = len(self._lines) - MOST_SHOWN
        self.more.setText(f"and {hidden} more")
        self.more.setVisible(hidden > 0)
        self.setVisible(bool(self._lines))
        self.updateGeometry()

    def _remove(self, line: _Line, _checked: bool = False) -> None:
        if line not in self._lines:
            return
        place = self._lines.index(line)
        focus = QApplication.focusWidget()
        focused = focus is not None and line.isAncestorOf(focus)
        self._lines.remove(line)
        self._column.removeWidget(line)
        line.hide()
        line.deleteLater()
        self._show()
        if focused and self._lines:
            # Escape, pressed again, dismisses the next one.
            self._lines[min(place, len(self._lines) - 1)].dismissal.setFocus()
        elif focused and self.image is not None:
            # Otherwise Qt would move it to the editor's first button.
            self.image.setFocus()


class _Line(Card):
    """One notice: its sentence, then its buttons."""

    def __init__(self, text: str, key: str, tone: NoticeTone) -> None:
        super().__init__()
        self.text, self.key = text, key
        self.setProperty("tone", tone)
        # File names in errors are plain text, and can be copied.
        self._label = QLabel(text, textFormat=Qt.TextFormat.PlainText, wordWrap=True)
        self._label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.setAccessibleName(f"Error: {text}" if tone == "error" else text)
        self.row = fill(QHBoxLayout(self), margins=(12, 4, 4, 4), spacing=8)
        self.row.addWidget(self._label, 1)
        self.dismissal = IconButton("close", "Dismiss", "Escape", colors=theme.ON_IMAGE)


TOP, BOTTOM = 40, 44  # distance to the upper edge (captions) and the lower one (colour bars)
SIDE, GAP = 8, 8  # least distance to the other edges, and between widgets, in pixels
TOOLS_END = 52, 146  # to the right of the tools over the image, and below them, in pixels
NARROW = 340  # width of an image beyond whose edges a notice reaches, in pixels

_KINDS = QEvent.Type
_PLACES = {
    *(_KINDS.Show, _KINDS.Hide, _KINDS.ShowToParent, _KINDS.HideToParent, _KINDS.LayoutRequest)
}
"""Events that may change a widget's size or visibility."""


class Floating(QObject):
    """Places widgets over an area, each as large as it must be."""

    def __init__(self, area: QWidget) -> None:
        super().__init__(area)
        self._area = area
        self._columns: dict[str, list[QWidget]] = {"top": [], "bottom": []}
        self._around: QWidget | None = None
        self._grip: tuple[QWidget, QPoint] | None = None
        self._moved: dict[QWidget, QPointF] = {}
        self._row: list[QWidget] = []  # at the bottom, in the order in which they were shown
        area.installEventFilter(self)

    def add(self, column: Literal["top", "bottom"], widget: QWidget) -> None:
        """Let a widget float at the top, or at the bottom, below or next to others."""
        hidden = widget.isHidden()
        widget.setParent(self._area)
        # A new parent hides the widget.
        widget.setVisible(not hidden)
        widget.installEventFilter(self)
        self._columns[column].append(widget)
        self._place()

    def set_corner_of(self, widget: QWidget | None) -> None:
        """Put the widgets at the bottom in the corner of a widget of the area, or of the area."""
        self._around = widget
        if widget is not None:
            widget.installEventFilter(self)
        self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Follow changes of positions and sizes, and the mouse that drags a card."""
        if isinstance(event, QMouseEvent) and watched in self._columns["bottom"]:
            return self._drag(watched, event)
        moved = event.type() in (QEvent.Type.Resize, QEvent.Type.Move)
        if (moved and watched in (self._area, self._around)) or event.type() in _PLACES:
            self._place()
        return False

    def _place(self) -> None:
        area = self._area.rect()
        ground, y = self._ground(), TOP
        for widget in self._shown("top"):
            size = self._size_of(widget, area if ground.width() < NARROW else ground)
            middle = ground.center().x() - size.width() // 2
            left = max(min(middle, area.width() - SIDE - size.width()), SIDE)
            if left < ground.left() + TOOLS_END[0]:
                y = max(y, min(TOOLS_END[1], area.height() - SIDE - size.height()))
            widget.setGeometry(left, y, size.width(), size.height())
            y += size.height() + GAP
        shown = self._shown("bottom")
        self._row += [widget for widget in shown if widget not in self._row]
        while self._row and self._row[-1] not in shown:
            # One that is closed keeps its room until those that came later are closed, too.
            self._row.pop()
        sizes = {widget: self._size_of(widget, area) for widget in self._row}
        for widget in [widget for widget in sizes if widget in self._moved]:
            size, share = sizes.pop(widget), self._moved[widget]
            free = _room(area, size)
            left, top = round(share.x() * free.x()), round(share.y() * free.y())
            widget.setGeometry(left, top, size.width(), size.height())
        in_row = sum(size.width() + GAP for size in sizes.values()) - GAP
        rows = [sizes] if in_row <= area.width() - 2 * SIDE else [{w: s} for w, s in sizes.items()]
        y = area.height() - BOTTOM
        for row in rows:
            y = self._place_row(row, y) - GAP

    def _place_row(self, row: dict[QWidget, QSize], bottom: int) -> int:
        """Place widgets side by side, and return their upper edge."""
        width = sum(size.width() + GAP for size in row.values()) - GAP
        corner = self._ground().left() + SIDE
        left = max(min(corner, self._area.width() - SIDE - width), 0)
        top = bottom
        for widget, size in row.items():
            # On a low screen it may cover the captions, but not leave the area.
            upper = max(bottom - size.height(), 0)
            # If it would reach the image's centre, it covers the colour bars.
            if bottom == self._area.height() - BOTTOM and upper <= self._ground().center().y():
                upper = max(self._area.height() - SIDE - size.height(), 0)
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

    def _ground(self) -> QRect:
        """Position of the cards' corner."""
        around = self._around
        if around is None or around.isHidden():
            return self._area.rect()
        return QRect(around.mapTo(self._area, around.rect().topLeft()), around.size())

    def _drag(self, card: QWidget, event: QMouseEvent) -> bool:
        """Grab, move or release a card; controls on it get clicks first."""
        kind, at = event.type(), event.globalPosition().toPoint()
        is_left = event.button() == Qt.MouseButton.LeftButton
        if kind == QEvent.Type.MouseButtonPress and is_left:
            self._grip = card, at - card.pos()
        elif kind == QEvent.Type.MouseButtonDblClick and is_left:
            self._moved.pop(card, None)
            self._place()
        elif kind == QEvent.Type.MouseMove and self._grip is not None and self._grip[0] is card:
            free, place = _room(self._area.rect(), card.size()), at - self._grip[1]
            # As a share of the free area, to follow the window's size.
            self._moved[card] = QPointF(
                min(max(place.x() / max(free.x(), 1), 0.0), 1.0),
                min(max(place.y() / max(free.y(), 1), 0.0), 1.0),
            )
            self._place()
        elif kind == QEvent.Type.MouseButtonRelease:
            self._grip = None
        # Events on a card do not reach the image.
        return True


def _room(area: QRect, size: QSize) -> QPoint:
    """Largest position of a widget's upper left corner in an area."""
    return QPoint(max(area.width() - size.width(), 0), max(area.height() - size.height(), 0))
