"""Edits that can be undone."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoCommand, QUndoStack

SAME_GESTURE_S = 1.0
"""Longest time between two changes of one gesture, such as those of a key that is held."""


class EditHistory(QObject):
    """Edits of all that the picture depends on, in one order; the clock is in seconds."""

    edited = Signal()
    """Emitted after a completed edit, undo or redo by the user."""
    undone = Signal()
    """Emitted after an undo or redo."""
    returning = Signal()
    """Emitted before an undo or redo; a current drag is to end, and counts as an edit."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.stack = QUndoStack(self)
        self.clock: Callable[[], float] = time.monotonic
        self._together: list[_Change] | None = None

    def change(
        self,
        show: Callable[[Any], object],
        before: object,
        after: object,
        text: str,
        merge_key: str | None = None,
    ) -> None:
        """Make a change that can be undone, by a function that shows a value; it is called now.

        Changes with the same merge key that follow each other within :data:`SAME_GESTURE_S` become
        one, such as those of a key that is held.
        """
        change = _Change(show, before, after, text, merge_key, self.clock())
        if self._together is not None:
            self._together.append(change)
            return
        self.stack.push(change)
        self.edited.emit()

    @contextmanager
    def as_one(self, text: str) -> Iterator[None]:
        """Make the changes of a block one edit of this name."""
        self._together = []
        try:
            yield
        finally:
            changes, self._together = self._together, None
            if changes:
                self.stack.beginMacro(text)
                for change in changes:
                    self.stack.push(change)
                self.stack.endMacro()
                self.edited.emit()

    def undo(self) -> None:
        """Undo the last edit."""
        self.returning.emit()
        self.stack.undo()
        self.edited.emit()
        self.undone.emit()

    def redo(self) -> None:
        """Redo the edit undone last; nothing is left to be redone after a drag."""
        self.returning.emit()
        self.stack.redo()
        self.edited.emit()
        self.undone.emit()


class _Change(QUndoCommand):
    """One change, made at a time in seconds; see :meth:`EditHistory.change`."""

    def __init__(
        self,
        show: Callable[[Any], object],
        before: Any,
        after: Any,
        text: str,
        merge_key: str | None,
        at: float,
    ) -> None:
        super().__init__(text)
        self._show = show
        self._before, self._after = before, after
        self._merge_key, self._at = merge_key, at

    def redo(self) -> None:
        """Show the value after the change."""
        self._show(self._after)

    def undo(self) -> None:
        """Show the value before the change."""
        self._show(self._before)

    def id(self) -> int:
        """Return 1 if the change can be merged; Qt merges only commands of equal id, not -1."""
        return -1 if self._merge_key is None else 1

    def mergeWith(self, other: QUndoCommand) -> bool:
        """Merge the next change of the same gesture by adopting its result."""
        if not isinstance(other, _Change) or other._merge_key != self._merge_key:
            return False
        if other._at - self._at > SAME_GESTURE_S:
            return False
        self._after, self._at = other._after, other._at
        return True
