"""What is kept of each volume for the next time: light, regions, view and the like."""

from __future__ import annotations

from functools import partial
from typing import Any

from PySide6.QtCore import QObject

from app.state.kept_inputs import KEPT_INPUTS, KeptInput, input_of, numbers_of
from app.state.known_volume import KnownRegion
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.sensitivity_state import NamedRegion, SensitivityState
from app.state.viewer_state import ViewerState
from model.scene.light import LightDirection
from model.scene.region import Outline
from model.scene.view import View


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
        angles = self._preferences.volume(self._fingerprint).light
        found: LightDirection | None = input_of("light", angles)
        return found or self._designed

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
            self._preferences.note_volume(self._fingerprint, light=numbers_of("light", moved))


class RegionKeeper(QObject):
    """Keeps the open volume's regions for the next time."""

    def __init__(
        self, sensitivity: SensitivityState, preferences: Preferences, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._sensitivity = sensitivity
        self._preferences = preferences
        self._fingerprint = ""
        sensitivity.regionsChanged.connect(self._regions_changed)
        sensitivity.regionChangeFinished.connect(self._keep)

    def start(self, opened: OpenedVolume) -> None:
        """Show those of another volume, and keep them from now on.

        The regions of another time step stay where it has none of its own.
        """
        self._fingerprint = ""
        known = self._preferences.volume(opened.fingerprint)
        regions = tuple(NamedRegion(one.name, Outline(one.points)) for one in known.regions)
        names = [region.name for region in regions]
        active = names.index(known.active_region) if known.active_region in names else None
        self._sensitivity.start_volume(opened.volume.series, regions, active, known.region_count)
        self._fingerprint = opened.fingerprint
        if self._sensitivity.regions != regions:
            self._keep()

    def _regions_changed(self) -> None:
        if not self._sensitivity.dragging:
            self._keep()

    def _keep(self) -> None:
        asked = self._sensitivity
        active = "" if asked.active is None else asked.region_name
        kept: dict[str, Any] = {
            "regions": tuple(KnownRegion(one.name, one.outline.points) for one in asked.regions),
            "active_region": active,
            "region_count": asked.count,
        }
        before = self._preferences.volume(self._fingerprint)
        changes = {name: value for name, value in kept.items() if value != getattr(before, name)}
        if self._fingerprint and changes:
            self._preferences.note_volume(self._fingerprint, **changes)


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
