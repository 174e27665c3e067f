"""Keeping of the view, the crop box and the like in which each volume is looked at."""

from __future__ import annotations

from functools import partial
from typing import Any

from PySide6.QtCore import QObject

from app.state.kept_inputs import KEPT_INPUTS, KeptInput, input_of, numbers_of
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from model.scene.view import View

KEPT_ELSEWHERE = ("light",)
"""Inputs that have a keeper of their own."""


class LookKeeper(QObject):
    """Keeps the open volume's view and edited inputs, such as the crop box, for the next time."""

    def __init__(self, state: ViewerState, preferences: Preferences, parent: QObject) -> None:
        super().__init__(parent)
        self._preferences = preferences
        self._fingerprint = ""
        self._names = [
            name for name in KEPT_INPUTS if name in state.edited and name not in KEPT_ELSEWHERE
        ]
        state.viewChangeFinished.connect(partial(self._keep, "view"))
        for name in self._names:
            state.edited[name].changeFinished.connect(partial(self._keep, name))

    def start(self, fingerprint: str) -> tuple[View | None, dict[str, Any]]:
        """Keep those of another volume from now on.

        Returns
        -------
        view : View or None
            The last one; None if it is unknown.
        others : dict of str
            The last values of other inputs, by name.
        """
        self._fingerprint = fingerprint
        known = self._preferences.volume(fingerprint)
        others: dict[str, Any] = {
            name: input_of(name, getattr(known, name)) for name in self._names
        }
        return input_of("view", known.view), others

    def _keep(self, name: KeptInput, value: Any) -> None:
        if self._fingerprint:
            seen: dict[str, Any] = {name: numbers_of(name, value)}
            self._preferences.note_volume(self._fingerprint, **seen)
