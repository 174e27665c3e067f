"""The TFs of the panes A and B: the one under edit is that of the pane with the focus."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal

from PySide6.QtCore import QObject, Signal

from app.state.edits import EditedInput, EditHistory
from model.scene.transfer_function import TransferFunction

PaneName = Literal["A", "B"]  # of the ground truth, and of the image that it is compared with


class EditedTF(EditedInput[TransferFunction]):
    """The TF of the pane that has the focus; the other pane's rests meanwhile.

    B's TF stays when B is no longer shown. An edit that is undone brings its pane back.
    """

    paneChanged = Signal()  # when the other pane has the focus, or B is shown or hidden

    def __init__(self, first: TransferFunction, history: EditHistory, parent: QObject) -> None:
        super().__init__(first, "drag", history, parent)
        self.pane: PaneName = "A"  # that has the focus
        self.compares = False  # whether B is shown
        self._other: TransferFunction | None = None  # of the pane without the focus

    def of(self, pane: PaneName) -> TransferFunction | None:
        """Return a pane's TF; None of a B that there never was."""
        return self._value if pane == self.pane else self._other

    def compare(self, compares: bool) -> None:
        """Show B, at first as a copy of A, with the focus; or show A alone."""
        self.focus("B" if compares else "A")
        if compares != self.compares:
            self.compares = compares
            self.paneChanged.emit()

    def focus(self, pane: PaneName) -> None:
        """Edit a pane's TF from now on; B is shown for that."""
        if pane == self.pane and self.compares == (self.compares or pane == "B"):
            return
        self.finish()
        self._show_pane(pane)
        self._announce()

    def copy(self, source: PaneName) -> None:
        """Copy a pane's TF to the other one, which has the focus from then on: an edit."""
        tf, target = self.of(source), _other(source)
        assert tf is not None
        self.focus(target)
        self.set(tf, f"copy {source} to {target}")

    def swap(self) -> None:
        """Exchange the TFs of A and B: an edit."""
        self.finish()
        both = self.of("A"), self.of("B")
        if None not in both:
            self._history.change(self._show_both, both, both[::-1], "swap A and B")

    def start(
        self, value: TransferFunction, other: TransferFunction | None = None, compares: bool = False
    ) -> None:
        """Take another volume's TFs of A, which has the focus, and B."""
        self.pane, self._other = "A", other
        self.compares = compares and other is not None
        self.paneChanged.emit()
        super().start(value)

    def convert_other(self, convert: Callable[[TransferFunction], TransferFunction]) -> None:
        """Convert the TF that is not under edit, as the volume is on another scale."""
        if self._other is not None:
            self._other = convert(self._other)

    def finish(self, text: str = "", merge_key: str | None = None) -> None:
        """End a drag, making it one edit, which is not merged with one of the other pane."""
        super().finish(text, merge_key and f"{merge_key} of {self.pane}")

    def _shows_again(self) -> Callable[[Any], object]:
        return partial(self._show_in, self.pane)

    def _show_in(self, pane: PaneName, value: TransferFunction) -> None:
        self.focus(pane)
        self._show(value)

    def _show_both(self, both: tuple[TransferFunction, TransferFunction]) -> None:
        shown = both if self.pane == "A" else both[::-1]
        self._value, self._other = shown
        self.compares = True
        self._announce()

    def _show_pane(self, pane: PaneName) -> None:
        self.compares = self.compares or pane == "B"
        if pane != self.pane:
            self._value, self._other = self._other or self._value, self._value
            self.pane = pane

    def _announce(self) -> None:
        # First the panes, which say what images are asked for.
        self.paneChanged.emit()
        self.changed.emit(self._value)
        self.changeFinished.emit(self._value)


def _other(pane: PaneName) -> PaneName:
    return "B" if pane == "A" else "A"
