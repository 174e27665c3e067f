"""Memories of each volume for the next time: light, regions, view and the like."""

from __future__ import annotations

from functools import partial
from typing import Any

from PySide6.QtCore import QObject

from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.state.volume_memory import VolumeMemory
from model.scene.scene import LightDirection


class LightKeeper(QObject):
    """Keeps where the user has moved the open volume's light, for the next time."""

    def __init__(self, state: ViewerState, preferences: Preferences, parent: QObject) -> None:
        super().__init__(parent)
        self._state, self._preferences = state, preferences
        self._fingerprint = ""
        self._designed: LightDirection | None = None
        self._keeps = True
        state.light_input.changeFinished.connect(self._keep)

    @property
    def known(self) -> LightDirection | None:
        """The light of this volume: where the user has moved it, or else as it was designed.

        None if it was neither.
        """
        return self._preferences.volume(self._fingerprint).light or self._designed

    def start(self, fingerprint: str, designed: LightDirection | None) -> None:
        """Keep that of another volume from now on, which may have been designed in a light."""
        self._fingerprint, self._designed = fingerprint, designed

    def place(self, light: LightDirection | None) -> None:
        """Set the light's direction without keeping it for the next run."""
        self._keeps = False
        self._state.start_light(light)
        self._keeps = True

    def _keep(self, light: LightDirection | None) -> None:
        if light is not None and self._keeps and self._fingerprint:
            moved = None if light == (self._designed or LightDirection()) else light
            self._preferences.note_volume(self._fingerprint, light=moved)


KEPT_INPUTS = ("crop",)
"""Edited inputs that are kept; the light has a keeper of its own."""


class VolumeKeeper(QObject):
    """Keeps the open volume's TF, view, crop box and regions for the next time."""

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        preferences: Preferences,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state, self._sensitivity = state, sensitivity
        self._preferences = preferences
        self._fingerprint = ""
        # After every edit, undo and redo.
        state.edits.edited.connect(self.keep_tf)
        state.viewChangeFinished.connect(partial(self._keep, "view"))
        for name in KEPT_INPUTS:
            state.edited[name].changeFinished.connect(partial(self._keep, name))
        sensitivity.changed.connect(self._sensitivity_changed)
        sensitivity.finished.connect(lambda _what: self._keep_regions())

    def start(self, opened: OpenedVolume) -> VolumeMemory:
        """Show another volume's regions, keep what is made of it from now on, and return it all.

        The regions of another time step stay where it has none of its own.
        """
        self._fingerprint = ""
        memory = self._preferences.volume(opened.fingerprint)
        names = [region.name for region in memory.regions]
        active = names.index(memory.active_region) if memory.active_region in names else None
        self._sensitivity.start_volume(
            opened.volume.series, memory.regions, active, memory.region_count
        )
        self._fingerprint = opened.fingerprint
        if self._sensitivity.regions != memory.regions:
            self._keep_regions()
        return memory

    def keep_tf(self) -> None:
        """Keep the present TF."""
        self._keep("tf", self._state.transfer_function)

    def _sensitivity_changed(self, what: str) -> None:
        if what == "regions" and not self._sensitivity.dragging:
            self._keep_regions()

    def _keep_regions(self) -> None:
        asked = self._sensitivity
        self._keep("regions", asked.regions)
        self._keep("active_region", "" if asked.active is None else asked.region_name)
        self._keep("region_count", asked.count)

    def _keep(self, name: str, value: Any) -> None:
        if self._fingerprint:
            self._preferences.note_volume(self._fingerprint, **{name: value})
