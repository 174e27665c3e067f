"""Keeping of the view and the crop box in which each volume is looked at."""

from __future__ import annotations

from dataclasses import astuple

from PySide6.QtCore import QObject

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
        state.viewChangeFinished.connect(self._keep_view)
        state.crop_input.changeFinished.connect(self._keep_crop)

    def start(self, fingerprint: str) -> tuple[View | None, CropBox | None]:
        """Keep those of another volume from now on, and return its last ones; None if unknown."""
        self._fingerprint = fingerprint
        known = self._preferences.volume(fingerprint)
        view = View(*known.view) if known.view else None
        if not known.crop:
            return view, None
        x0, y0, z0, x1, y1, z1 = known.crop
        return view, CropBox((x0, y0, z0), (x1, y1, z1))

    def _keep_view(self, view: View) -> None:
        if self._fingerprint:
            self._preferences.note_volume(self._fingerprint, view=astuple(view))

    def _keep_crop(self, crop: CropBox | None) -> None:
        if self._fingerprint:
            planes = () if crop is None else (*crop.low, *crop.high)
            self._preferences.note_volume(self._fingerprint, crop=planes)
