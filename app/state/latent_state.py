"""Choices of a user who browses: brush, mouse, colours of the map, filters, places and trail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from model.latent.interpolation import Brush
from model.scene.transfer_function import OpacityTF, Range

Coloring = Literal["value", "opacity", "modes", "distance", "error"]
"""Dominant scalar value, mean opacity of the picture, number of modes, distance to the present
TF, or the model's error."""

EngineChoice = Literal["automatic", "exact", "learned"]
CodecChoice = Literal["shipped", "model"]
Drawn = Literal["code", "tf"]
MapTool = Literal["brush", "lasso"]
Place = tuple[float, float]

TRAIL_LENGTH = 200
"""Edits whose places are remembered."""

FIRST_BRUSH: Brush = (-0.8, -0.8, 0.8, 0.8)
"""Most of the map, as in the paper's examples."""


@dataclass(frozen=True)
class LatentChoices:
    """Choices of how the map is shown, and who draws its pictures.

    Attributes
    ----------
    shown : bool
        Whether the browser is open.
    coloring : str
        What the colours of the map mean.
    engine : {"automatic", "exact", "learned"}
        Who draws; automatic takes the ray caster where it is fast enough.
    codec : {"shipped", "model"}
        Whose codes these are.
    drawn : {"code", "tf"}
        What pictures by a model are drawn from that draws codes: these, or the TFs that they
        are decoded to.
    as_modes : bool
        Whether a TF of the map becomes modes, instead of a curve.
    nearest : bool
        Whether an empty cell shows its nearest sample.
    band : tuple of float, or None
        Only TFs that show some of these scalar values are bright; None for all.
    """

    shown: bool = False
    coloring: Coloring = "value"
    engine: EngineChoice = "automatic"
    codec: CodecChoice = "shipped"
    drawn: Drawn = "code"
    as_modes: bool = False
    nearest: bool = False
    band: Range | None = None


@dataclass(frozen=True, eq=False)
class NamedPlace:
    """A TF that the user wants to find again.

    Attributes
    ----------
    place : tuple of float
        On the map.
    picture : ndarray of float32, shape (S, S, 4), or None
        What it showed when it was named.
    """

    name: str
    place: Place
    tf: OpacityTF
    picture: NDArray[np.float32] | None = None


@dataclass(frozen=True)
class Visited:
    """A step of the trail: where an edit of the TF has led to.

    Attributes
    ----------
    place : tuple of float
        On the present map.
    code : tuple of float
        Of the TF, by which its place on another map is found.
    """

    place: Place
    code: tuple[float, ...]


@dataclass(frozen=True)
class Trail:
    """Steps that edits of the TF have made on the map.

    Attributes
    ----------
    space : str
        Name of the latent space that the codes belong to.
    """

    space: str = ""
    steps: tuple[Visited, ...] = ()


class LatentState(QObject):
    """Brush, place under the mouse, filters, named places and the trail of edits."""

    choicesChanged = Signal(object)
    brushChanged = Signal(object)
    """Emitted with the rectangle while it is drawn, moved or resized."""
    brushChangeFinished = Signal()
    hoverChanged = Signal(object)
    """Emitted with the place under the mouse on the map, or None."""
    lassoChanged = Signal(object)
    """Emitted with the corners of the lasso, or None."""
    placesChanged = Signal()
    trailChanged = Signal()
    toolChanged = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.choices = LatentChoices()
        self.brush: Brush = FIRST_BRUSH
        self.dragging = False
        self.hover: Place | None = None
        self.hover_sample: int | None = None
        self.closeness = 1.0
        self.lasso: tuple[Place, ...] | None = None
        self.places: tuple[NamedPlace, ...] = ()
        self.trail = Trail()
        self.tool: MapTool = "brush"
        self._named = 0

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
            self.brushChangeFinished.emit()

    def set_brush(self, brush: Brush) -> None:
        """Change the rectangle without a drag."""
        self.move_brush(brush)
        self.finish_brush()

    def set_hover(
        self, place: Place | None, sample: int | None = None, closeness: float = 1.0
    ) -> None:
        """Set the place under the mouse.

        Parameters
        ----------
        place : tuple of float, or None
            None when the mouse leaves the map.
        sample : int, optional
            The sample whose thumbnail is there; nothing is interpolated then.
        closeness : float
            How many times closer one looks than at the whole map.
        """
        if (place, sample, closeness) != (self.hover, self.hover_sample, self.closeness):
            self.hover, self.hover_sample, self.closeness = place, sample, closeness
            self.hoverChanged.emit(place)

    def set_lasso(self, corners: tuple[Place, ...] | None) -> None:
        """Keep only what is inside a polygon bright; None for all."""
        if corners != self.lasso:
            self.lasso = corners
            self.lassoChanged.emit(corners)

    def set_tool(self, tool: MapTool) -> None:
        """Choose what the next drag on the map draws."""
        if tool != self.tool:
            self.tool = tool
            self.toolChanged.emit(tool)

    def name_place(
        self,
        place: Place,
        tf: OpacityTF,
        name: str = "",
        picture: NDArray[np.float32] | None = None,
    ) -> None:
        """Add a named place; without a name it is numbered."""
        self._named += 1
        named = NamedPlace(name or f"Place {self._named}", place, tf, picture)
        self.places = (*self.places, named)
        self.placesChanged.emit()

    @property
    def place_count(self) -> int:
        """Number of the last place that was numbered."""
        return self._named

    def set_places(self, places: tuple[NamedPlace, ...], count: int) -> None:
        """Show the named places of another volume.

        Parameters
        ----------
        count : int
            Number of the last one that was numbered.
        """
        self.places, self._named = places, count
        self.placesChanged.emit()

    def rename_place(self, index: int, name: str) -> None:
        """Rename a place."""
        places = list(self.places)
        places[index] = replace(places[index], name=name)
        self.places = tuple(places)
        self.placesChanged.emit()

    def forget_place(self, index: int) -> None:
        """Remove a named place."""
        self.places = self.places[:index] + self.places[index + 1 :]
        self.placesChanged.emit()

    def extend_trail(self, space: str, step: Visited) -> None:
        """Remember where an edit of the TF has led to."""
        steps = self.trail.steps if space == self.trail.space else ()
        if not steps or steps[-1].place != step.place:
            self.set_trail(Trail(space, (*steps, step)[-TRAIL_LENGTH:]))

    def set_trail(self, trail: Trail) -> None:
        """Show another trail."""
        if trail != self.trail:
            self.trail = trail
            self.trailChanged.emit()

    def clear_trail(self) -> None:
        """Forget the trail."""
        self.set_trail(Trail())

    def start_map(
        self,
        space: str,
        place_of: Callable[[OpacityTF], Place],
        place_of_code: Callable[[tuple[float, ...]], Place],
    ) -> None:
        """Begin with another map: named places and trail are where it has them.

        Parameters
        ----------
        space : str
            Name of its latent space; the trail of another one is forgotten.
        place_of, place_of_code : callable
            Return the new place of a TF, and of a code.
        """
        self.places = tuple(replace(one, place=place_of(one.tf)) for one in self.places)
        if self.trail.space == space:
            steps = (Visited(place_of_code(step.code), step.code) for step in self.trail.steps)
            self.set_trail(Trail(space, tuple(steps)))
        else:
            self.clear_trail()
        self.placesChanged.emit()
        self.start_choices()

    def start_choices(self) -> None:
        """Forget what was chosen on the map: lasso and brush."""
        self.lasso = None
        self.lassoChanged.emit(None)
        self.set_hover(None)
        self.set_brush(FIRST_BRUSH)
