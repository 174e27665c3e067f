"""Keeping of what the user has marked in each volume: regions, named TFs, the trail of edits."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject

from app.state.known_volume import KnownPlace, KnownRegion, KnownTrail
from app.state.latent_state import LatentState, NamedPlace, Trail, Visited
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.sensitivity_state import NamedRegion, SensitivityState
from model.scene.region import Outline
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction

_NO_COLOR = 0.0, 0.0, 0.0


class MarksKeeper(QObject):
    """Keeps the open volume's regions, named TFs and trail for the next time."""

    def __init__(
        self,
        sensitivity: SensitivityState,
        latent: LatentState,
        preferences: Preferences,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._sensitivity, self._latent = sensitivity, latent
        self._preferences = preferences
        self._fingerprint = ""
        self._pictures: dict[int, tuple[NDArray[np.float32], str]] = {}
        sensitivity.regionsChanged.connect(self._regions_changed)
        sensitivity.regionChangeFinished.connect(self._keep_regions)
        latent.placesChanged.connect(self._keep_places)
        latent.trailChanged.connect(self._keep_trail)

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
        self._pictures.clear()
        self._latent.set_places(tuple(map(_named, known.places)), known.place_count)
        # Where the steps are, the map says once it is open.
        steps = tuple(Visited((0.0, 0.0), code) for code in known.trail.codes)
        self._latent.set_trail(Trail(known.trail.space, steps))
        self._fingerprint = opened.fingerprint
        if self._sensitivity.regions != regions:
            self._keep_regions()

    def _regions_changed(self) -> None:
        if not self._sensitivity.dragging:
            self._keep_regions()

    def _keep_regions(self) -> None:
        asked = self._sensitivity
        regions = tuple(KnownRegion(one.name, one.outline.points) for one in asked.regions)
        active = "" if asked.active is None else asked.region_name
        self._note(regions=regions, active_region=active, region_count=asked.count)

    def _keep_places(self) -> None:
        places = tuple(self._known(named) for named in self._latent.places)
        self._note(places=places, place_count=self._latent.place_count)

    def _keep_trail(self) -> None:
        trail = self._latent.trail
        self._note(trail=KnownTrail(trail.space, tuple(step.code for step in trail.steps)))

    def _note(self, **known: Any) -> None:
        before = self._preferences.volume(self._fingerprint)
        changes = {name: value for name, value in known.items() if value != getattr(before, name)}
        if self._fingerprint and changes:
            self._preferences.note_volume(self._fingerprint, **changes)

    def _known(self, named: NamedPlace) -> KnownPlace:
        tf = TransferFunction(named.tf, _black(named.tf)).to_json()
        x, y = named.place
        return KnownPlace(named.name, tf, (float(x), float(y)), self._encoded(named.picture))

    def _encoded(self, picture: NDArray[np.float32] | None) -> str:
        """Return a picture as PNG in base64, once encoded for as long as it is there."""
        if picture is None:
            return ""
        if id(picture) not in self._pictures:
            self._pictures[id(picture)] = picture, _png(picture)
        return self._pictures[id(picture)][1]


def _named(known: KnownPlace) -> NamedPlace:
    tf = TransferFunction.from_json(known.tf).opacity
    x, y = known.place
    return NamedPlace(known.name, (x, y), tf, _picture(known.picture))


def _black(opacity: OpacityTF) -> ColorTF:
    lo, hi = opacity.scalar_range
    return ColorTF((lo, hi), ((lo, *_NO_COLOR), (hi, *_NO_COLOR)))


def _png(picture: NDArray[np.float32]) -> str:
    # Imported here: the window starts without it.
    import imageio.v3 as iio

    pixels = np.rint(255 * np.clip(picture, 0.0, 1.0)).astype(np.uint8)
    return base64.b64encode(iio.imwrite("<bytes>", pixels, extension=".png")).decode()


def _picture(encoded: str) -> NDArray[np.float32] | None:
    """Return the picture of a PNG in base64; None where it is none or cannot be read."""
    if not encoded:
        return None
    import imageio.v3 as iio

    try:
        pixels = iio.imread(base64.b64decode(encoded), extension=".png")
    except (OSError, ValueError, SyntaxError):
        return None
    if pixels.ndim != 3 or pixels.shape[2] != 4:
        return None
    return (pixels / 255).astype(np.float32)
