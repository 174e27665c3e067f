"""Edits of the scene's inputs and the brightness, and their undo history."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Generic, Literal, TypeVar

from PySide6.QtCore import QObject, Signal
from PySide6.QtGui import QUndoCommand, QUndoStack

from app.engines.client import EngineName
from model.rendering.brightness import usual_brightness
from model.scene.scene import Lighting

SAME_GESTURE_S = 1.0  # between two changes of one gesture, as by a key that is held


class EditHistory(QObject):
    """Undo history of everything that the picture depends on; the clock is in seconds."""

    edited = Signal()  # emitted after a completed edit, undo or redo by the user
    undone = Signal()  # emitted after an undo or redo
    returning = Signal()  # emitted before an undo or redo, which ends a current drag as an edit

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
        """Call a function that shows the new value, and make that an undo step.

        Changes with the same merge key within :data:`SAME_GESTURE_S` become one, such as those of a
        held key.
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
        self._go(self.stack.undo)

    def redo(self) -> None:
        """Redo the edit undone last; nothing is left to be redone after a drag."""
        self._go(self.stack.redo)

    def _go(self, step: Callable[[], None]) -> None:
        self.returning.emit()
        step()
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
        self.value = self._before = first
        self._drag, self._history = drag, history
        self.moving = False  # whether it is dragged
        self.is_edited = False  # by the user, since it was started
        history.returning.connect(self.finish)

    def move(self, value: T) -> None:
        """Change the value during a drag."""
        value = self._normal(value)
        if value != self.value:
            if not self.moving:
                self._before = self.value
            self.moving = True
            self.value = value
            self.changed.emit(value)

    def finish(self, text: str = "", merge_key: str | None = None) -> None:
        """End a drag, if there is one, making it one edit; see :meth:`EditHistory.change`."""
        if not self.moving:
            return
        self.moving = False
        if self.value == self._before:
            self.changeFinished.emit(self.value)
        else:
            self.is_edited = True
            self._change(text or self._drag, merge_key)

    def cancel(self) -> None:
        """Go back to the value from before the drag, if there is one."""
        if self.moving:
            self.moving, was_edited = False, self.is_edited
            self._show(self._before)
            self.is_edited = was_edited

    def set(self, value: T, text: str = "", merge_key: str | None = None) -> None:
        """Change the value without a drag, as one edit; a current drag ends first, as another."""
        self.finish(text)
        self.move(value)
        self.finish(text, merge_key)

    def start(self, value: T) -> None:
        """Take the value of another volume or lighting, which is not an edit."""
        self.moving = self.is_edited = False
        self.value = value
        self.changed.emit(value)
        self.changeFinished.emit(value)

    def _change(self, text: str, merge_key: str | None) -> None:
        """Make a drag that has ended an edit."""
        self._history.change(self._show, self._before, self.value, text, merge_key)

    def _show(self, value: T) -> None:
        # The end of a drag does not change the value, so that nothing is redrawn.
        if value != self.value and self._may_return(value):
            self.value, self.is_edited = value, True
            self.changed.emit(value)
        self.changeFinished.emit(self.value)

    def _normal(self, value: T) -> T:
        """Return the value to keep of two equal ones."""
        return value

    def _may_return(self, value: T) -> bool:
        """Whether an undone or redone value may be shown."""
        return True


DARKEST, BRIGHTEST = 0.25, 32.0  # limits; the largest is that of an exposed picture of the map
STEPS_PER_OCTAVE = 8  # steps of a slider from one brightness to its double


Lit = EngineName | Literal["b"]  # owners of lights: an engine, or B


class Brightness(EditedInput[float | None]):
    """Brightness of all images, previews and saved pictures, as chosen for the reference.

    It changes neither the TF nor any result. None is the light's default. If model and reference
    have different lights, each has its own default, and a choice scales both by the same factor.
    """

    def __init__(self, history: EditHistory, parent: QObject) -> None:
        super().__init__(None, "brightness", history, parent)
        self.usual: dict[Lit, float] = {"exact": 1.0, "learned": 1.0, "b": 1.0}  # in their lights

    def of(self, engine: Lit) -> float:
        """Return the brightness of an engine's images in its own light; 1 changes nothing."""
        chosen = self.usual["exact"] if self.value is None else self.value
        return chosen * self.usual[engine] / self.usual["exact"]

    def set(self, value: float | None, text: str = "", merge_key: str | None = None) -> None:
        """Choose a brightness; None for the usual. Choices in quick succession are one edit."""
        super().set(value, text, merge_key or "brightness")

    def set_lighting(self, engine: Lit, lighting: Lighting) -> None:
        """Follow the light of an engine's images: of the reference, of the model, or of B."""
        usual = usual_brightness(lighting)
        if usual != self.usual[engine]:
            self.usual[engine] = usual
            self.changed.emit(self.value)

    @property
    def step(self) -> int:
        """Nearest step of a slider; 0 for a brightness of 1."""
        return round(STEPS_PER_OCTAVE * math.log2(self.of("exact")))

    def _normal(self, value: float | None) -> float | None:
        return None if value is None else min(max(value, DARKEST), BRIGHTEST)


def brightness_at(step: int) -> float:
    """Return the brightness at a step of a slider."""
    return round(2.0 ** (step / STEPS_PER_OCTAVE), 3)
