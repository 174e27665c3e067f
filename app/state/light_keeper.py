"""Keeping of the light's direction in which each volume is looked at."""

from __future__ import annotations

from PySide6.QtCore import QObject

from app.state.kept_inputs import input_of, numbers_of
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from model.scene.light import LightDirection


class LightKeeper(QObject):
    """Keeps where the user has moved the open volume's light, for the next time."""

    def __init__(self, state: ViewerState, preferences: Preferences, parent: QObject) -> None:
        super().__init__(parent)
        self._state, self._preferences = state, preferences
        self._fingerprint = ""
        self._keeps = True
        state.light_input.changeFinished.connect(self._keep)

    @property
    def known(self) -> LightDirection | None:
        """The light that the user has moved in this volume; None if it was not moved."""
        angles = self._preferences.volume(self._fingerprint).light
        found: LightDirection | None = input_of("light", angles)
        return found

    def start(self, fingerprint: str) -> None:
        """Keep that of another volume from now on."""
        self._fingerprint = fingerprint

    def place(self, light: LightDirection | None) -> None:
        """Set the light's direction without keeping it for the next run."""
        self._keeps = False
        self._state.start_light(light)
        self._keeps = True

    def _keep(self, light: LightDirection | None) -> None:
        if light is not None and self._keeps and self._fingerprint:
            moved = None if light == LightDirection() else light
            self._preferences.note_volume(self._fingerprint, light=numbers_of("light", moved))
