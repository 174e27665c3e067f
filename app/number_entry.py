"""Entry of numbers: boxes that leave the window its keys, and take what is typed."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, Qt, QTimer
from PySide6.QtGui import QKeyEvent, QKeySequence, QValidator
from PySide6.QtWidgets import QAbstractSpinBox, QSpinBox, QToolTip

NUMBER_CHARACTERS = set("0123456789+-.,eE")


class NumberKeys(QObject):
    """Gives keys back to the window: all of them after Enter, and those that type no number.

    So a number is entered, and Ctrl+Z then undoes what it has changed, or R draws a region.

    Parameters
    ----------
    box : QAbstractSpinBox
        Its typing comes first: Ctrl+Z takes back what was typed and not yet entered.
    """

    def __init__(self, box: QAbstractSpinBox) -> None:
        super().__init__(box)
        self._box = box
        box.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Leave shortcuts to the window, and the focus after Enter."""
        if not isinstance(event, QKeyEvent):
            return False
        if event.type() == QEvent.Type.KeyPress:
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                # Once the box has taken the number.
                QTimer.singleShot(0, self._box.clearFocus)
            return False
        if event.type() == QEvent.Type.ShortcutOverride and self._is_the_windows(event):
            event.ignore()
            return True
        return False

    def _is_the_windows(self, event: QKeyEvent) -> bool:
        line = self._box.lineEdit()
        if event.matches(QKeySequence.StandardKey.Undo):
            return not line.isUndoAvailable()
        if event.matches(QKeySequence.StandardKey.Redo):
            return not line.isRedoAvailable()
        typed = event.text()
        plain = event.modifiers() in (
            Qt.KeyboardModifier.NoModifier,
            Qt.KeyboardModifier.ShiftModifier,
        )
        return plain and typed.isprintable() and bool(typed) and not set(typed) <= NUMBER_CHARACTERS


class WholeNumberBox(QSpinBox):
    """Spin box in which any whole number can be typed; on Enter the nearest allowed one counts.

    Qt's own box swallows the digits that lead out of its range, and takes 40 for 400.
    """

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Accept numbers within the range, and let others be typed."""
        number = _number(text)
        if number is None:
            typing = text.strip() in ("", "-", "+")
            state = QValidator.State.Intermediate if typing else QValidator.State.Invalid
        else:
            inside = self.minimum() <= number <= self.maximum()
            state = QValidator.State.Acceptable if inside else QValidator.State.Intermediate
        return state, text, position

    def fixup(self, text: str) -> str:
        """Take the nearest number of the range, and show the range."""
        number = _number(text)
        if number is None:
            return str(self.value())
        limits = f"From {self.minimum()} to {self.maximum()}"
        QToolTip.showText(self.mapToGlobal(self.rect().bottomLeft()), limits, self)
        return str(min(max(number, self.minimum()), self.maximum()))


def _number(text: str) -> int | None:
    try:
        return int(text)
    except ValueError:
        return None
