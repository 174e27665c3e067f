"""Selection of handles in the editor, all of one kind."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import QObject, Signal

from model.scene.transfer_function import TransferFunction

Kind = Literal["opacity", "color"]


@dataclass(frozen=True)
class Selected:
    """A handle of the opacity TF or of the colour TF, identified by its index."""

    kind: Kind
    index: int


class Selection(QObject):
    """Holds the selected handles and emits `changed`.

    One of them is the current one, whose numbers are shown.
    """

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._handles: tuple[Selected, ...] = ()
        self._flank: int | None = None
        self._known: tuple[object, ...] = ()
        self._before: tuple[Selected, ...] = ()
        """Selection from before a handle was added."""

    @property
    def selected(self) -> Selected | None:
        """The current handle, the one selected last; None if there is none."""
        return self._handles[-1] if self._handles else None

    def index(self, kind: Kind) -> int | None:
        """Return the index of the current handle if it is of this kind, or None."""
        selected = self.selected
        return selected.index if selected is not None and selected.kind == kind else None

    def indices(self, kind: Kind) -> tuple[int, ...]:
        """Return the indices of all selected handles of this kind, in order."""
        return tuple(sorted(handle.index for handle in self._handles if handle.kind == kind))

    @property
    def flank(self) -> int | None:
        """0 or 1 if keys act on the left or right flank of the current mode; else None."""
        return self._flank

    def select(self, kind: Kind, index: int, flank: int | None = None) -> None:
        """Select one handle only, or a flank of it."""
        self._set((Selected(kind, index),), flank)

    def select_all(self, kind: Kind, indices: Iterable[int]) -> None:
        """Select these handles; the last one becomes the current one."""
        self._set(tuple(Selected(kind, index) for index in dict.fromkeys(indices)))

    def toggle(self, kind: Kind, index: int) -> None:
        """Add a handle, or take it away; those of the other kind are no longer selected."""
        handle = Selected(kind, index)
        same = tuple(h for h in self._handles if h.kind == kind and h != handle)
        self._set(same if handle in self._handles else (*same, handle))

    def clear(self) -> None:
        """Clear the selection."""
        self._set(())

    def fit(self, transfer_function: TransferFunction) -> None:
        """Take away handles that no longer exist; select one that was added to the others.

        When it is gone again, as by undo, what was selected before is so again.
        """
        opacity, color = transfer_function.opacity, transfer_function.color
        handles: tuple[object, ...] = opacity.points or opacity.modes
        known, self._known = self._known, handles
        added = [i for i, handle in enumerate(handles) if handle not in known]
        if len(added) == 1 and 0 < len(known) == len(handles) - 1:
            before = self._handles
            self.select("opacity", added[0])
            self._before = before
            return
        wanted, gone = self._handles, [i for i, handle in enumerate(known) if handle not in handles]
        if self._before and not added and wanted == tuple(Selected("opacity", i) for i in gone):
            wanted, self._before = self._before, ()
        counts = {"opacity": len(handles), "color": len(color.stops)}
        left = tuple(h for h in wanted if h.index < counts[h.kind])
        flank = None if opacity.points or left != self._handles else self._flank
        self._change(left, flank)

    def _set(self, handles: tuple[Selected, ...], flank: int | None = None) -> None:
        """Select what the user wants."""
        self._before = ()
        self._change(handles, flank)

    def _change(self, handles: tuple[Selected, ...], flank: int | None) -> None:
        if (handles, flank) != (self._handles, self._flank):
            self._handles, self._flank = handles, flank
            self.changed.emit()
