"""Pieces connected to the clicked place, to be shown alone or cut away."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from PySide6.QtCore import QObject, Signal

from app.engines.background import LatestCall
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import EMPTY_TF, ViewerState
from model.errors import TfscopeError
from model.rendering.pieces import Piece, pieces_at, pieces_under
from model.rendering.scale_bar import volume_text
from model.scene.inputs import SceneInputs
from model.scene.view import from_middle
from model.scene.volume import Triple, Volume

SEEKING = "The search for what is connected to this place is still running."
NO_PIECE = "Click in an image or a slice first, to choose the connected voxels there."


class PieceFinder(QObject):
    """Finds the pieces at the clicked place, in a thread of its own."""

    changed = Signal()  # emitted when other pieces are found, or none

    def __init__(
        self,
        state: ViewerState,
        asked: SensitivityState,
        volume: Callable[[], Volume | None],
        say: Callable[[str], object],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state, self._asked, self._volume, self._say = state, asked, volume, say
        self.pieces: tuple[Piece, ...] = ()
        self._waits: bool | None = None  # whether what is sought is to be shown alone, or cut away
        self._wanted: tuple[Volume, SceneInputs, tuple[float, float]] | None = None
        self._call = LatestCall("pieces", self, self._take, self._refuse)
        self.stop, self.join = self._call.stop, self._call.join
        asked.changed.connect(self._follow)
        state.inputsChangeFinished.connect(self._ask)

    @property
    def is_searching(self) -> bool:
        """Whether the pieces at the clicked place are still to come."""
        return self._call.is_awaited

    def space_of(self, piece: Piece) -> str:
        """Return the size of a piece, in words."""
        volume = self._volume()
        return "" if volume is None else volume_text(piece.count, volume)

    def take(self, number: int, alone: bool) -> None:
        """Show a piece alone, or cut it away: an edit that can be undone."""
        if number >= len(self.pieces):
            self._say(SEEKING if self._call.is_awaited else NO_PIECE)
            return
        self._mask_by(self.pieces[number], alone)

    def take_at(self, place: Triple, alone: bool) -> None:
        """Show the piece at a place alone, or all but it, as soon as it is found."""
        if (volume := self._volume()) is not None:
            # A search at the clicked place may be running.
            self._call.forget()
            self._wanted, self._waits = None, alone
            self._call.ask(partial(pieces_at, volume, self._state.inputs, np.array(place)))

    def _mask_by(self, piece: Piece, alone: bool) -> None:
        try:
            mask = piece.left(self._state.mask_input.value, alone)
        except TfscopeError as error:
            self._say(str(error))
            return
        name = "isolate connected voxels" if alone else "cut connected voxels away"
        self._state.mask_input.set(mask, name)
        what = f"piece of {self.space_of(piece)}"
        said = f"Only this {what} is shown." if alone else f"A {what} is cut away."
        back = "Undo or Edit > Show all voxels shows everything again."
        self._say(f"{said} {back} File > Save mask writes this to a file.")

    def _follow(self, what: str) -> None:
        if what in ("place", "choices"):
            self._ask()

    def _ask(self, _value: object = None) -> None:
        volume, place = self._volume(), self._asked.place
        wanted = None
        if volume is not None and place is not None and self._asked.choices.shown:
            # Pieces do not depend on light and colours.
            inputs = replace(self._state.inputs, light=None, color_tf=EMPTY_TF.color)
            wanted = volume, inputs, from_middle(place)
        if wanted != self._wanted:
            self._wanted = wanted
            # The found pieces, and those being searched, belong to another place or scene.
            self._call.forget()
            if wanted is not None:
                self._call.ask(partial(pieces_under, *wanted))
            self._take(())

    def _refuse(self, text: str) -> None:
        if self._waits is not None:
            self._say(text)
        self._take(())

    def _take(self, pieces: tuple[Piece, ...]) -> None:
        waits, self._waits = self._waits, None
        if waits is not None and pieces:
            self._mask_by(pieces[0], waits)
            return
        if pieces != self.pieces:
            self.pieces = pieces
            self.changed.emit()
