"""The TFs of panes A and B, one of which is edited, and the look of B."""

from __future__ import annotations

from functools import partial
from typing import Literal

from PySide6.QtCore import QObject, Signal

from app.state.edits import EditedInput, EditHistory
from app.state.settings import LookOfB
from model.scene.ranges import fit_to_range
from model.scene.transfer_function import TransferFunction

PaneName = Literal["A", "B"]  # of the ground truth, and of the image that it is compared with


class EditedTF(EditedInput[TransferFunction]):
    """The TF of the pane with the focus; the other pane's is kept.

    Both have one range and scale. B's TF and look are kept while B is hidden. Undoing an edit shows
    its pane again.
    """

    paneChanged = Signal()  # when the other pane has the focus, or B is shown, hidden or another
    exchanged = Signal(object)
    """Emitted before `changed` with a TF that is no edit of the one before, such as a preset."""

    def __init__(self, first: TransferFunction, history: EditHistory, parent: QObject) -> None:
        super().__init__(first, "drag", history, parent)
        self.pane: PaneName = "A"  # that has the focus
        self.compares = False  # whether B is shown
        self.look = LookOfB()  # of B
        self._other: TransferFunction | None = None  # of the pane without the focus

    def of(self, pane: PaneName) -> TransferFunction | None:
        """Return a pane's TF; None if there never was a B."""
        return self.value if pane == self.pane else self._other

    def compare(self, compares: bool) -> None:
        """Show B, at first as a copy of A, with the focus; or show A alone."""
        self.focus("B" if compares else "A")
        if compares != self.compares:
            self.compares = compares
            self.paneChanged.emit()

    def focus(self, pane: PaneName) -> None:
        """Edit a pane's TF from now on; B is shown for that."""
        if pane != self.pane or (pane == "B" and not self.compares):
            self.finish()
            self._show_pair(pane, pane == "B", (self.of(pane) or self.value, self.value))

    def exchange(self, value: TransferFunction, text: str) -> None:
        """Replace the TF by one that is not an edit of it, such as a preset: an edit."""
        self.finish(text)
        if value != self.value:
            pairs = (self.value, self._other), (value, _fitted(self._other, value))
            self._history.change(partial(self._show_pair, self.pane, False), *pairs, text)

    def focus_other(self) -> None:
        """Edit the other one of A and B from now on, if both are shown."""
        if self.compares:
            self.focus(other_pane(self.pane))

    def copy(self, source: PaneName) -> None:
        """Copy a pane's TF to the other one, which gets the focus: an edit."""
        tf, target = self.of(source), other_pane(source)
        if tf is not None:
            self.focus(target)
            self.exchange(tf, f"copy {source} to {target}")

    def swap(self) -> None:
        """Exchange the TFs of A and B: an edit."""
        self.finish()
        if self._other is not None:
            pair = self.value, self._other
            shows = partial(self._show_pair, self.pane, True)
            self._history.change(shows, pair, pair[::-1], "swap A and B")

    def set_look(self, look: LookOfB, text: str) -> None:
        """Draw B in another light, or by another renderer: an edit."""
        if look != self.look:
            self._history.change(self._show_look, self.look, look, text)

    def start(
        self,
        value: TransferFunction,
        other: TransferFunction | None = None,
        compares: bool = False,
        look: LookOfB | None = None,
    ) -> None:
        """Take another volume's TFs of A and B, and the look of B; A gets the focus."""
        self.pane, self.compares = "A", compares and other is not None
        self.look = look or LookOfB()
        self.value, self._other = value, other
        self.paneChanged.emit()
        self.exchanged.emit(value)
        super().start(value)

    def _show_look(self, look: LookOfB) -> None:
        self.look = look
        if not self.compares:
            self.focus("B")
        self.paneChanged.emit()

    def _change(self, text: str, merge_key: str | None) -> None:
        """Make a drag an edit; it is not merged with an edit of the other pane."""
        before, after = self._before, self.value
        shows = partial(self._show_pair, self.pane, False, exchanges=False)
        key = merge_key and f"{merge_key} of {self.pane}"
        pairs = (before, self._other), (after, _fitted(self._other, after))
        self._history.change(shows, *pairs, text, key)

    def _show_pair(
        self, pane: PaneName, compares: bool, pair: _Pair, exchanges: bool = True
    ) -> None:
        """Give a pane the focus, and show its TF and the other one's, if there is one."""
        value, other = pair
        before = self.value, self.pane, self.compares, self._other
        other = other or _fitted(self.of(other_pane(pane)), value)
        compares = compares or self.compares or pane == "B"
        self.value, self.pane, self.compares, self._other = value, pane, compares, other
        # The panes come first, because they determine the requested images.
        if before[1:] != (pane, compares, other):
            self.paneChanged.emit()
        if value != before[0]:
            if exchanges or pane != before[1]:
                self.exchanged.emit(value)
            self.is_edited = True
            self.changed.emit(value)
        self.changeFinished.emit(value)


_Pair = tuple[TransferFunction, TransferFunction | None]


def other_pane(pane: PaneName) -> PaneName:
    """Return B for A, and A for B."""
    return "B" if pane == "A" else "A"


def _fitted(tf: TransferFunction | None, to: TransferFunction) -> TransferFunction | None:
    """Return a TF over another one's range, or that other one if the scales differ."""
    if tf is not None and tf.scale != to.scale:
        return to
    return tf and fit_to_range(tf, to.scalar_range)
