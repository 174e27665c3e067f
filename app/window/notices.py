"""Notices over the images: errors, offers, and what is to be known."""

from __future__ import annotations

from functools import partial
from typing import Literal

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QFrame, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app import theme
from app.controls import Action, action_button, announce, order_focus
from app.icons import IconButton

WIDTH = 480
"""Of a notice at most, as longer lines are hard to read."""

MOST_SHOWN, MOST_KEPT = 3, 20
"""Notices that are shown at once, and that are kept until there is room."""

MOST_ACTIONS = 2
"""Buttons of one notice, apart from the one that dismisses it."""

NoticeTone = Literal["plain", "error"]


class Notices(QWidget):
    """Lists notices, the newest first, until the user dismisses each; hidden without any.

    Of many the newest are shown, and how many more there are. When the first is dismissed, the
    button of the next is in its place. Escape dismisses the notice whose button has the focus.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._lines: list[_Line] = []
        self._before: QWidget | None = None
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(4)
        self.more = QLabel()
        self.more.setProperty("role", "dim")
        self.more.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        self.more.setStyleSheet(f"color: {theme.ON_IMAGE.dim}")
        self._column.addWidget(self.more)
        self.more.hide()
        self.hide()

    @property
    def text(self) -> str:
        """The sentences, one a line, the newest first; empty if there is none."""
        return "\n".join(line.text for line in self._lines)

    def come_after(self, widget: QWidget) -> None:
        """Have Tab go from a widget to the notices that come from now on."""
        self._before = widget

    def add(self, text: str, *actions: Action, key: str = "", tone: NoticeTone = "plain") -> None:
        """Show a notice above those that are there, instead of one with the same text or key.

        Each of its buttons, at most two, removes it before it acts. An empty text only removes.
        """
        if len(actions) > MOST_ACTIONS:
            raise ValueError(f"A notice has room for {MOST_ACTIONS} actions, not {len(actions)}.")
        for line in [*self._lines]:
            if line.text == text or (key and line.key == key):
                self._remove(line)
        if not text:
            return
        line = _Line(text, key, tone)
        buttons: list[QWidget] = [action_button(a, partial(self._remove, line)) for a in actions]
        buttons.append(line.dismissal)
        line.dismissal.clicked.connect(partial(self._remove, line))
        self._lines.insert(0, line)
        self._column.insertWidget(0, line)
        for button in buttons:
            line.row.addWidget(button)
        if self._before is not None:
            # Else Tab would reach them after all the rest of the window.
            order_focus([self._before, *buttons])
        for old in self._lines[MOST_KEPT:]:
            self._remove(old)
        self._show()
        announce(self, text, at_once=tone == "error")

    def clear(self, key: str = "") -> None:
        """Remove the notice with a key; without one, remove all."""
        for line in [*self._lines]:
            if not key or line.key == key:
                self._remove(line)

    def dismiss_newest(self) -> bool:
        """Remove the notice that is shown first; return False if there is none."""
        if self._lines:
            self._remove(self._lines[0])
            return True
        return False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Dismiss the notice that has the focus on Escape."""
        if event.key() == Qt.Key.Key_Escape and not event.modifiers():
            for line in [*self._lines]:
                if line.has_focus:
                    self._remove(line)
                    return
        super().keyPressEvent(event)

    def sizeHint(self) -> QSize:
        """Return the size of notices of the usual width."""
        return QSize(WIDTH, self._column.heightForWidth(WIDTH))

    def minimumSizeHint(self) -> QSize:
        """Take any width."""
        return QSize(0, 0)

    def _show(self) -> None:
        """Show the newest notices, and how many more there are."""
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
        focused = line.has_focus
        self._lines.remove(line)
        self._column.removeWidget(line)
        line.hide()
        line.deleteLater()
        self._show()
        if self._lines and focused:
            # Escape, pressed again, dismisses the next one.
            self._lines[min(place, len(self._lines) - 1)].dismissal.setFocus()


class _Line(QFrame):
    """One notice: its sentence, then its buttons."""

    def __init__(self, text: str, key: str, tone: NoticeTone) -> None:
        super().__init__()
        self.key = key
        self.setProperty("role", "card")
        self.setProperty("tone", tone)
        self.setCursor(Qt.CursorShape.ArrowCursor)
        self._label = QLabel(text)
        # File names in errors are plain text, and can be copied.
        self._label.setTextFormat(Qt.TextFormat.PlainText)
        self._label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._label.setWordWrap(True)
        self.setAccessibleName(f"Error: {text}" if tone == "error" else text)
        self.row = QHBoxLayout(self)
        self.row.setContentsMargins(12, 4, 4, 4)
        self.row.setSpacing(8)
        self.row.addWidget(self._label, 1)
        self.dismissal = IconButton("close", "Dismiss", "Escape", colors=theme.ON_IMAGE)

    @property
    def text(self) -> str:
        return self._label.text()

    @property
    def has_focus(self) -> bool:
        """Whether one of the buttons, or the sentence, takes the keys."""
        focused = QApplication.focusWidget()
        return focused is not None and self.isAncestorOf(focused)
