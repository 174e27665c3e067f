"""A bar below the images for errors and important notices."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QFrame, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from app.controls import Action, action_button, text_button

MOST_NOTICES = 4
"""Notices that are shown at once; older ones give way."""

MOST_ACTIONS = 2
"""Buttons of one notice, apart from the one that dismisses it."""


class NoticeBar(QFrame):
    """Lists notices, the newest lowest, until the user dismisses each; hidden without any.

    It grows upwards: when the lowest is dismissed, the button of the next is in its place.
    Escape dismisses the notice whose button has the focus.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setProperty("role", "notice")
        self._lines: list[_Line] = []
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(12, 6, 8, 6)
        self._column.setSpacing(4)
        self.hide()

    @property
    def text(self) -> str:
        """The displayed sentences, one a line, the newest first; empty if there is none."""
        return "\n".join(line.text for line in self._lines)

    def tell(self, text: str, *actions: Action, key: str = "") -> None:
        """Show a notice below those that are there.

        Parameters
        ----------
        text : str
            It replaces a notice with the same text. An empty one only removes that of its key.
        *actions : Action
            At most two buttons. Each removes the notice before it acts.
        key : str
            The notice replaces one with the same key; empty for none.

        Raises
        ------
        ValueError
            For more than two actions.
        """
        if len(actions) > MOST_ACTIONS:
            raise ValueError(f"A notice has room for {MOST_ACTIONS} actions, not {len(actions)}.")
        for line in [*self._lines]:
            if line.text == text or (key and line.key == key):
                self._remove(line)
        if not text:
            return
        line = _Line(text, key)
        for action in actions:
            line.row.addWidget(action_button(action, partial(self._remove, line)))
        line.row.addWidget(line.dismissal)
        line.dismissal.clicked.connect(partial(self._remove, line))
        self._lines.insert(0, line)
        self._column.addWidget(line)
        line.show()
        for old in self._lines[MOST_NOTICES:]:
            self._remove(old)
        self.show()

    def clear(self, key: str = "") -> None:
        """Remove the notice with a key; without one, remove all."""
        for line in [*self._lines]:
            if not key or line.key == key:
                self._remove(line)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Dismiss the notice that has the focus on Escape."""
        if event.key() == Qt.Key.Key_Escape and not event.modifiers():
            for line in [*self._lines]:
                if line.has_focus:
                    self._remove(line)
                    return
        super().keyPressEvent(event)

    def _remove(self, line: _Line, _checked: bool = False) -> None:
        if line not in self._lines:
            return
        place = self._lines.index(line)
        focused = line.has_focus
        self._lines.remove(line)
        self._column.removeWidget(line)
        line.hide()
        line.deleteLater()
        if not self._lines:
            self.hide()
        elif focused:
            # Escape, pressed again, dismisses the next one.
            self._lines[min(place, len(self._lines) - 1)].dismissal.setFocus()


class _Line(QWidget):
    """One notice: its sentence, then its buttons."""

    def __init__(self, text: str, key: str) -> None:
        super().__init__()
        self.key = key
        self._label = QLabel(text)
        # File names in errors are plain text, and worth copying.
        self._label.setTextFormat(Qt.TextFormat.PlainText)
        self._label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._label.setWordWrap(True)
        self.row = QHBoxLayout(self)
        self.row.setContentsMargins(0, 0, 0, 0)
        self.row.setSpacing(8)
        self.row.addWidget(self._label, 1)
        self.dismissal = text_button("✕", "Dismiss (Escape)")
        self.dismissal.setAccessibleName("Dismiss")
        self.dismissal.setAutoRaise(True)

    @property
    def text(self) -> str:
        return self._label.text()

    @property
    def has_focus(self) -> bool:
        """Whether one of the buttons, or the sentence, takes the keys."""
        focused = QApplication.focusWidget()
        return focused is not None and self.isAncestorOf(focused)
