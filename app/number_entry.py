"""Entry of numbers: boxes that leave the window its keys, and lose nothing that is typed."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from typing import cast

from PySide6.QtCore import QEvent, QObject, QPoint, QSignalBlocker, Qt, QTimer
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence, QValidator
from PySide6.QtWidgets import QAbstractSpinBox, QDoubleSpinBox, QLabel, QSpinBox, QWidget
from shiboken6 import isValid

from app.typed_numbers import NUMBER_CHARACTERS, read_number, without_unit
from app.wheel_guard import WheelGuard

_STEPS = (Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_PageUp, Qt.Key.Key_PageDown)


class NumberEntry(QObject):
    """Text typed into a number box: taken, or refused with a reason until it is mended.

    A refused number stays in the box, which has a red rim and the reason above it, wherever the
    focus goes; Escape brings the last number back, also where what is typed could be taken.

    Letters are no keys of the window while the box has the focus: who types "abc" means no
    command. After Enter all keys are the window's again. So a number is entered, and Ctrl+Z then
    undoes what it has changed, or R draws a region.

    Parameters
    ----------
    box : QSpinBox or QDoubleSpinBox
        Its typing comes first: Ctrl+Z takes back what was typed and not yet entered.
    refusal : callable
        Returns why a text is not taken, in a sentence; empty if it is.

    Attributes
    ----------
    is_below : bool
        Whether the reason stands below the box, instead of above it.
    """

    def __init__(self, box: QSpinBox | QDoubleSpinBox, refusal: Callable[[str], str]) -> None:
        super().__init__(box)
        self._box = box
        self._refusal = refusal
        self._note: _Reason | None = None
        self.is_below = False
        WheelGuard(box)
        box.installEventFilter(self)
        box.lineEdit().textEdited.connect(self.forget)

    @property
    def reason(self) -> str:
        """Why the number in the box is refused; empty if it is not."""
        return "" if self._note is None else self._note.text()

    def check(self) -> bool:
        """Return whether the text in the box can be taken; if not, say why."""
        reason = self._refusal(self._box.lineEdit().text())
        if reason:
            self.forget()
            self._note = _Reason(self._box, reason, self.is_below)
            self._mark(True)
            self._box.setAccessibleDescription(reason)
        return not reason

    def retry(self) -> None:
        """Take a number that was refused if it can be taken by now."""
        if self._note is not None and self.check():
            self.forget()
            self._box.interpretText()

    def show_value(self, value: float) -> None:
        """Show a value without a signal; a refused number stays if it is no news."""
        if value == self._box.value() and self.reason:
            return
        self.forget()
        with QSignalBlocker(self._box):
            self._box.setValue(value)  # type: ignore[arg-type]

    @contextmanager
    def new_limits(self) -> Iterator[None]:
        """Set other limits meanwhile, without a signal; a number refused before may be taken."""
        refused = self._box.lineEdit().text() if self.reason else ""
        with QSignalBlocker(self._box):
            yield
        if refused:
            self._box.lineEdit().setText(refused)
            # Once whoever sets the limits has also shown the value.
            QTimer.singleShot(0, self._box, self.retry)

    def state_of(
        self, text: str, characters: Container[str] = NUMBER_CHARACTERS
    ) -> QValidator.State:
        """Whether a text is accepted, or may be typed on the way to one that is."""
        if not all(character in characters for character in text):
            return QValidator.State.Invalid
        return QValidator.State.Intermediate if self._refusal(text) else QValidator.State.Acceptable

    def forget(self) -> None:
        """Refuse nothing any more, as the number is another."""
        if self._note is not None:
            self._note.hide()
            self._note.deleteLater()
            self._note = None
            self._mark(False)
            self._box.setAccessibleDescription("")

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Keep a refused number, leave shortcuts to the window, and the focus after Enter."""
        kind = event.type()
        if not isValid(self._box):
            # It loses the focus while it is deleted.
            return False
        if kind == QEvent.Type.FocusOut:
            popup = cast(QFocusEvent, event).reason() == Qt.FocusReason.PopupFocusReason
            if popup or self.check():
                return False
            # The box itself would bring its last number back.
            self._box.lineEdit().event(event)
            self._box.update()
            return True
        if kind == QEvent.Type.KeyPress:
            return self._press(cast(QKeyEvent, event))
        if kind == QEvent.Type.ShortcutOverride and self._is_the_windows(cast(QKeyEvent, event)):
            event.ignore()
            return True
        return False

    def _press(self, event: QKeyEvent) -> bool:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            if not self.check():
                event.accept()
                return True
            # Once the box has taken the number.
            QTimer.singleShot(0, self._box.clearFocus)
        elif event.key() == Qt.Key.Key_Escape and self._is_typed:
            self.forget()
            with QSignalBlocker(self._box):
                self._box.setValue(self._box.value())  # type: ignore[arg-type]
            self._box.selectAll()
            return True
        elif event.key() in _STEPS:
            self.forget()
        return False

    @property
    def _is_typed(self) -> bool:
        """Whether there is something in the box that was not taken, or not yet."""
        return self._note is not None or self._box.lineEdit().isModified()

    def _mark(self, refused: bool) -> None:
        self._box.setProperty("refused", refused)
        self._box.style().unpolish(self._box)
        self._box.style().polish(self._box)

    def _is_the_windows(self, event: QKeyEvent) -> bool:
        line = self._box.lineEdit()
        if event.matches(QKeySequence.StandardKey.Undo):
            return not line.isUndoAvailable()
        if event.matches(QKeySequence.StandardKey.Redo):
            return not line.isRedoAvailable()
        return False


class _Reason(QLabel):
    """Says at a box why its number is refused, for as long as box and window are in sight."""

    def __init__(self, box: QAbstractSpinBox, reason: str, is_below: bool) -> None:
        super().__init__(reason, box, Qt.WindowType.ToolTip)
        self._box = box
        self._is_below = is_below
        self._window = box.window()
        self.setProperty("role", "refusal")
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setAttribute(Qt.WidgetAttribute.WA_ShowWithoutActivating)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        # The box may lie in a card that moves.
        for watched in {box, box.parentWidget() or box, self._window}:
            watched.installEventFilter(self)
        self._place()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Go along with the box, and away with the window."""
        kind = event.type()
        if kind in (QEvent.Type.Hide, QEvent.Type.WindowDeactivate):
            self.hide()
        elif kind in (
            QEvent.Type.Move, QEvent.Type.Resize, QEvent.Type.Show, QEvent.Type.WindowActivate,
        ):  # fmt: skip
            # Once all of it has been laid out.
            QTimer.singleShot(0, self, self._place)
        return False

    def _place(self) -> None:
        if not self._box.isVisible():
            return
        self.adjustSize()
        room = self._box.screen().availableGeometry()
        corner = self._box.mapToGlobal(QPoint(0, 0))
        x = max(min(corner.x(), room.right() - self.width()), room.left())
        # Above the box where the next one to be filled in is below.
        above, below = corner.y() - 2 - self.height(), corner.y() + self._box.height() + 2
        is_low = below + self.height() > room.bottom()
        self.move(x, above if above >= room.top() and (is_low or not self._is_below) else below)
        self.show()


def first_refused(parent: QWidget) -> QAbstractSpinBox | None:
    """Return the first number box in a dialog whose number is refused, with the focus; or None."""
    for box in parent.findChildren(QAbstractSpinBox):
        entry = box.findChild(NumberEntry)
        if entry is not None and box.isEnabled() and not entry.check():
            box.setFocus()
            box.selectAll()
            return box
    return None


class WholeNumberBox(QSpinBox):
    """Spin box for whole numbers; one that is not within its limits stays there, and says why.

    Qt's own box swallows the digits that lead out of its range, and takes 40 for 400.
    """

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.entry = NumberEntry(self, self._refusal)

    def set_limits(self, lowest: int, highest: int) -> None:
        """Set the range without emitting a signal; a number refused before may be taken now."""
        if (lowest, highest) == (self.minimum(), self.maximum()):
            return
        with self.entry.new_limits():
            self.setRange(lowest, highest)

    def show_value(self, value: int) -> None:
        """Show a value without emitting a signal; a refused number stays if it is no news."""
        self.entry.show_value(value)

    def validate(self, text: str, position: int) -> tuple[QValidator.State, str, int]:
        """Accept numbers within the range, and let others be typed."""
        return self.entry.state_of(text, NUMBER_CHARACTERS | set(self.suffix())), text, position

    def valueFromText(self, text: str) -> int:
        """Read a number that is accepted."""
        return round(read_number(without_unit(text, self.suffix()), whole=True))

    def fixup(self, text: str) -> str:
        """Leave it as it is typed."""
        return text

    def _refusal(self, text: str) -> str:
        return refusal(
            without_unit(text, self.suffix()), self.minimum(), self.maximum(), str, whole=True
        )


def refusal(
    text: str,
    lowest: float,
    highest: float,
    shown: Callable[[float], str],
    whole: bool = False,
) -> str:
    """Return why a typed number is not taken, in a sentence; empty if it is.

    Parameters
    ----------
    lowest, highest : float
        Limits, included.
    shown : callable
        Writes a limit.
    whole : bool
        Whether it shall be a whole number.
    """
    try:
        number = read_number(text, whole)
    except ValueError as error:
        return str(error)
    if lowest <= number <= highest:
        return ""
    side = "below" if number < lowest else "above"
    return f"{text.strip()} is {side} the limits: from {shown(lowest)} to {shown(highest)}."
