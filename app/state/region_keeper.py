"""Keeping of the regions that the user has drawn in each volume's images."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QObject

from app.state.known_volume import KnownRegion
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.sensitivity_state import NamedRegion, SensitivityState
from model.scene.region import Outline


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
