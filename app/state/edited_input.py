"""One input of the scene that the user edits: dragged, set, undone."""

from __future__ import annotations

from typing import Generic, TypeVar

from PySide6.QtCore import QObject, Signal

from app.state.edit_history import EditHistory

T = TypeVar("T")


class EditedInput(QObject, Generic[T]):
    """An input of the scene, such as the transfer function (TF), with undo.

    A drag is previewed with :meth:`move`, and becomes one edit by :meth:`finish`. Signals come in
    pairs, as in pyqtgraph: one at every step of a drag, one at its end.
    """

    changed = Signal(object)
    changeFinished = Signal(object)

    def __init__(self, first: T, drag: str, history: EditHistory, parent: QObject) -> None:
        super().__init__(parent)
        self._value = self._before = first
        self._drag, self._history = drag, history
        self._moving = False
        history.returning.connect(self.finish)

    @property
    def value(self) -> T:
        """The current value."""
        return self._value

    @property
    def moving(self) -> bool:
        """True during a drag."""
        return self._moving

    def move(self, value: T) -> None:
        """Change the value during a drag."""
        value = self._normal(value)
        if value != self._value:
            if not self._moving:
                self._before = self._value
            self._moving = True
            self._value = value
            self.changed.emit(value)

    def finish(self, text: str = "", merge_key: str | None = None) -> None:
        """End a drag, if there is one, making it one edit; see :meth:`EditHistory.change`."""
        if not self._moving:
            return
        self._moving = False
        if self._value == self._before:
            self.changeFinished.emit(self._value)
        else:
            text = text or self._name(self._value)
            self._history.change(self._show, self._before, self._value, text, merge_key)

    def cancel(self) -> None:
        """Go back to the value from before the drag, if there is one."""
        if self._moving:
            self._moving = False
            self._show(self._before)

    def set(self, value: T, text: str = "", merge_key: str | None = None) -> None:
        """Change the value without a drag: one edit; a current drag is another one before it.

        See :meth:`finish`.
        """
        self.finish(text)
        self.move(value)
        self.finish(text, merge_key)

    def start(self, value: T) -> None:
        """Take the value of another volume or lighting, which is no edit."""
        self._moving = False
        self._value = value
        self.changed.emit(value)
        self.changeFinished.emit(value)

    def _show(self, value: T) -> None:
        # The end of a drag does not change the value, so that nothing is redrawn.
        if value != self._value and self._may_return(value):
            self._value = value
            self.changed.emit(value)
        self.changeFinished.emit(self._value)

    def _name(self, after: T) -> str:
        """Return the name of a drag that ended at a value."""
        return self._drag

    def _normal(self, value: T) -> T:
        """Return the one of several equal values that is kept."""
        return value

    def _may_return(self, value: T) -> bool:
        """Whether a value may be shown again that was undone or redone."""
        return True
