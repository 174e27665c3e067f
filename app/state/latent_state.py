"""Choices of a user who browses: brush, mouse and filter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

from PySide6.QtCore import QObject, Signal

from model.latent.latent_map import Brush
from model.scene.transfer_function import Range

CodecChoice = Literal["shipped", "model"]
Place = tuple[float, float]

FIRST_BRUSH: Brush = (-0.8, -0.8, 0.8, 0.8)
"""Most of the map, as in the paper's examples."""


@dataclass(frozen=True)
class LatentChoices:
    """Choices of what is shown."""

    shown: bool = False
    """Whether the browser is open."""
    on_map: bool = False
    """Whether the map and a grid of its cells are shown, not the most different pictures."""
    codec: CodecChoice = "shipped"
    """Whose codes these are."""
    band: Range | None = None
    """Only TFs that show some of these scalar values are bright; None for all."""


class LatentState(QObject):
    """Brush, place under the mouse, and choices."""

    choicesChanged = Signal(object)
    brushChanged = Signal(object)
    """Emitted with the rectangle while it is drawn, moved or resized, and at the end of that."""
    hoverChanged = Signal(object)
    """Emitted with the place under the mouse on the map, or None."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.choices = LatentChoices()
        self.brush: Brush = FIRST_BRUSH
        self.dragging = False
        self.hover: Place | None = None
        self.closeness = 1.0

    def choose(self, **changes: Any) -> None:
        """Change some of the :class:`LatentChoices`."""
        choices = replace(self.choices, **changes)
        if choices != self.choices:
            self.choices = choices
            self.choicesChanged.emit(choices)

    def move_brush(self, brush: Brush) -> None:
        """Change the rectangle during a drag."""
        if brush != self.brush:
            self.brush, self.dragging = brush, True
            self.brushChanged.emit(brush)

    def finish_brush(self) -> None:
        """End a drag of the rectangle."""
        if self.dragging:
            self.dragging = False
            self.brushChanged.emit(self.brush)

    def set_brush(self, brush: Brush) -> None:
        """Change the rectangle without a drag."""
        self.move_brush(brush)
        self.finish_brush()

    def set_hover(self, place: Place | None, closeness: float = 1.0) -> None:
        """Set the place under the mouse, or None, and how much closer than the whole map it is."""
        if (place, closeness) != (self.hover, self.closeness):
            self.hover, self.closeness = place, closeness
            self.hoverChanged.emit(place)

    def start_choices(self) -> None:
        """Forget what was chosen on the map."""
        self.set_hover(None)
        self.set_brush(FIRST_BRUSH)
