"""Pieces connected to the clicked place, to be shown alone or cut away; the place in space."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from PySide6.QtCore import QObject, Signal

from app.engines.background import LatestCall
from app.state.sensitivity_asker import SensitivityAsker
from app.state.viewer_state import EMPTY_TF
from model.errors import TfscopeError
from model.rendering.pieces import Piece, pieces_at, pieces_under
from model.rendering.ray_places import most_visible
from model.rendering.scale_bar import volume_text
from model.scene.transfer_function import Range
from model.scene.view import NEAREST_DEPTH, Projection, View, from_middle
from model.scene.volume import Triple, Volume


class PieceFinder(QObject):
    """Finds the pieces at the clicked place, in a thread of its own."""

    changed = Signal()  # emitted when a search begins and when it has ended
    located = Signal()  # emitted when the point at a newly clicked place is known

    def __init__(
        self,
        asker: SensitivityAsker,
        volume: Callable[[], Volume | None],
        say: Callable[[str], object],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state, self._asker, self._volume, self._say = asker.state, asker, volume, say
        self.pieces: tuple[Piece, ...] = ()
        self._waits: bool | None = None  # whether what is sought is to be shown alone, or cut away
        self._wanted: object = None
        self._call = LatestCall("pieces", self, self._take, self._refuse)
        self.stop, self.join = self._call.stop, self._call.join
        asker.answered.connect(self._follow)
        self.point: Triple | None = None  # the most visible one at the clicked place, if any
        asker.asked.changed.connect(self._find_point)
        asker.state.viewChanged.connect(self._carry)

    @property
    def is_searching(self) -> bool:
        """Whether the pieces at the clicked place are still to come."""
        asked, pick = self._asker.asked, self._asker.pick
        is_listed = pick is not None and pick.is_of(self._state.inputs)
        is_asked = asked.choices.shown and asked.place is not None
        return self._call.is_awaited or (is_asked and not is_listed)

    def space_of(self, piece: Piece) -> str:
        """Return the size of a piece, and of all that is visible of its values, in words."""
        volume = self._volume()
        if volume is None:
            return ""
        size, whole = (volume_text(count, volume) for count in (piece.count, piece.among))
        number, unit = size.split(" ")
        number = number if whole.endswith(f" {unit}") else size
        return size if size == whole else f"{number} of {whole}"

    def take(self, number: int, alone: bool) -> None:
        """Show a piece alone, or cut it away: an edit that can be undone."""
        if self.is_searching:
            self._say("The search for what is connected to this place is still running.")
        elif number >= len(self.pieces):
            self._say("Click in an image or a slice first, to choose the connected voxels there.")
        else:
            self._mask_by(self.pieces[number], alone)

    def take_at(self, place: Triple, alone: bool) -> None:
        """Show the piece at a place alone, or all but it, as soon as it is found."""
        if (volume := self._volume()) is not None:
            # A search at the clicked place may be running.
            self._call.forget()
            self._wanted, self._waits = None, alone
            self._call.ask(partial(pieces_at, volume, self._state.inputs, np.array(place)))

    def _find_point(self, what: str) -> None:
        if what == "place":
            self.point = None
            if not self._asker.asked.choices.shown:
                self._locate(())

    def _locate(self, listed: tuple[Range, ...]) -> None:
        volume, place = self._volume(), self._asker.asked.place
        if volume is not None and place is not None:
            found = most_visible(volume, self._state.inputs, from_middle(place), listed)
            self.point = None if found is None else (found[0], found[1], found[2])
            self.located.emit()

    def _carry(self, view: View) -> None:
        """Keep the clicked place on the point that was visible there."""
        projection = Projection(view, self._state.proportions)
        point = np.reshape(self.point or (), (-1, 3))
        if (projection.depths(point) > NEAREST_DEPTH).any():
            ((right, up),) = projection.places(point).tolist()
            self._asker.asked.carry(((1 + right) / 2, (1 - up) / 2))

    def _mask_by(self, piece: Piece, alone: bool) -> None:
        try:
            mask = piece.left(self._state.mask_input.value, alone)
        except TfscopeError as error:
            self._say(str(error))
            return
        name = "isolate connected voxels" if alone else "cut connected voxels away"
        self._state.mask_input.set(mask, name)
        size = self.space_of(piece)
        said = f"Only this piece is shown: {size}." if alone else f"Cut away: {size}."
        back = "Undo or Edit > Show all voxels shows everything again."
        self._say(f"{said} {back} File > Save mask writes this to a file.")

    def _follow(self, question: str) -> None:
        """Search once the values at the clicked place are listed: a piece may have those alone."""
        volume, place, pick = self._volume(), self._asker.asked.place, self._asker.pick
        if question != "pick":
            return
        wanted = None
        if volume is not None and place is not None and pick is not None:
            inputs = pick.request.inputs
            listed = tuple(one.reach for one in self._asker.listed)
            # Pieces do not depend on light and colours.
            inputs = replace(inputs, light=None, color_tf=EMPTY_TF.color)
            wanted = volume, inputs, from_middle(place), listed
            if self.point is None:
                self._locate(listed)
        if self._waits is not None:
            return
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
        self.pieces = pieces
        self.changed.emit()
