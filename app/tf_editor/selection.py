"""Which handle of the editor is selected: one, or none."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from PySide6.QtCore import QObject, Signal

from model.scene.transfer_function import TransferFunction

Kind = Literal["opacity", "color"]


@dataclass(frozen=True)
class Selected:
    """A handle of the opacity TF or of the colour TF, by its index."""

    kind: Kind
    index: int


class Selection(QObject):
    """Holds the selected handle and says when it changes."""

    changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._selected: Selected | None = None

    @property
    def selected(self) -> Selected | None:
        """The selected handle."""
        return self._selected

    def index(self, kind: Kind) -> int | None:
        """Index of the selected handle when it is of this kind."""
        selected = self._selected
        return selected.index if selected is not None and selected.kind == kind else None

    def select(self, kind: Kind, index: int) -> None:
        """Select a handle instead of any other."""
        self._set(Selected(kind, index))

    def clear(self) -> None:
        """Select nothing."""
        self._set(None)

    def fit(self, transfer_function: TransferFunction) -> None:
        """Drop the selection when its handle is gone."""
        opacity, color = transfer_function.opacity, transfer_function.color
        counts = {"opacity": len(opacity.points or opacity.modes), "color": len(color.stops)}
        if self._selected is not None and self._selected.index >= counts[self._selected.kind]:
            self.clear()

    def _set(self, selected: Selected | None) -> None:
        if selected != self._selected:
            self._selected = selected
            self.changed.emit()
