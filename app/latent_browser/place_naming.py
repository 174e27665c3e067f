"""Names of places on the map, asked for in a dialog."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject
from PySide6.QtWidgets import QInputDialog, QWidget

from app.state.latent_state import LatentState, Place
from app.state.latent_thumbnails import thumbnail
from app.state.viewer_state import ViewerState
from model.scene.transfer_function import OpacityTF

Images = NDArray[np.float32]


class PlaceNaming(QObject):
    """Asks for the names of places, and renames them.

    Parameters
    ----------
    state : ViewerState
    latent : LatentState
        It keeps the places.
    parent : QWidget
        Parent of dialogs.
    """

    def __init__(self, state: ViewerState, latent: LatentState, parent: QWidget) -> None:
        super().__init__(parent)
        self._state, self._latent, self._parent = state, latent, parent

    def ask(self, place: Place, tf: OpacityTF, picture: Images | None) -> None:
        """Ask for the name of a TF's place.

        Parameters
        ----------
        picture : ndarray of float32, shape (S, S, 4), or None
            What the TF shows.
        """
        text = f"Place {self._latent.place_count + 1}"
        self._ask_text(text, partial(self.name, place, tf, picture))

    def name(self, place: Place, tf: OpacityTF, picture: Images | None, name: str) -> None:
        """Name a TF's place."""
        # Another volume may have been opened meanwhile.
        if tf.scalar_range == self._state.scalar_range:
            small = None if picture is None else thumbnail(picture)
            self._latent.name_place(place, tf, name, small)

    def rename(self, index: int) -> None:
        """Ask for another name of a place."""
        self._ask_text(
            self._latent.places[index].name,
            lambda name: self._latent.rename_place(index, name),
        )

    def _ask_text(self, text: str, take: Callable[[str], None]) -> None:
        dialog = QInputDialog(self._parent)
        dialog.setWindowTitle("Name a place")
        dialog.setLabelText("Name of the place:")
        dialog.setTextValue(text)
        dialog.textValueSelected.connect(take)
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()
