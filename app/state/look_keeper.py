"""Keeping of the view and the crop box in which each volume is looked at."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QObject

from app.state.kept_inputs import KeptInput, input_of, numbers_of
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from model.scene.crop import CropBox
from model.scene.view import View


class LookKeeper(QObject):
    """Keeps the open volume's view and crop box for the next time."""

    def __init__(self, state: ViewerState, preferences: Preferences, parent: QObject) -> None:
        super().__init__(parent)
        self._preferences = preferences
        self._fingerprint = ""
        state.viewChangeFinished.connect(lambda view: self._keep("view", view))
        state.crop_input.changeFinished.connect(lambda crop: self._keep("crop", crop))

    def start(self, fingerprint: str) -> tuple[View | None, CropBox | None]:
        """Keep those of another volume from now on, and return its last ones; None if unknown."""
        self._fingerprint = fingerprint
        known = self._preferences.volume(fingerprint)
        return input_of("view", known.view), input_of("crop", known.crop)

    def _keep(self, name: KeptInput, value: View | CropBox | None) -> None:
        if self._fingerprint:
            seen: dict[str, Any] = {name: numbers_of(name, value)}
            self._preferences.note_volume(self._fingerprint, **seen)
