"""Selection of at most one handle in the editor."""

from __future__ import annotations

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
    """Holds the selected handle and emits `changed`."""

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._selected: Selected | None = None

    @property
    def selected(self) -> Selected | None:
        """The selected handle; None if there is none."""
        return self._selected

    def index(self, kind: Kind) -> int | None:
        """Return the index of the selected handle if it is of this kind, or None."""
        selected = self._selected
        return selected.index if selected is not None and selected.kind == kind else None

    def select(self, kind: Kind, index: int) -> None:
        """Select a handle."""
        self._set(Selected(kind, index))

    def clear(self) -> None:
        """Clear the selection."""
        self._set(None)

    def fit(self, transfer_function: TransferFunction) -> None:
        """Clear the selection if its handle no longer exists."""
        opacity, color = transfer_function.opacity, transfer_function.color
        counts = {"opacity": len(opacity.points or opacity.modes), "color": len(color.stops)}
        if self._selected is not None and self._selected.index >= counts[self._selected.kind]:
            self.clear()

    def _set(self, selected: Selected | None) -> None:
        if selected != self._selected:
            self._selected = selected
            self.changed.emit()
