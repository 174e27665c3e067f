"""Brightness of the images: how bright they are shown, kept for each volume."""

from __future__ import annotations

import math

from PySide6.QtCore import QObject, Signal

from app.engines.client import EngineName
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.viewer_state import ViewerState
from model.rendering.brightness import usual_brightness
from model.scene.scene import Lighting

DARKEST, BRIGHTEST = 0.25, 32.0
"""Limits of the brightness; the greatest is that of an exposed picture of the map."""

STEPS_PER_OCTAVE = 8
"""Steps of a slider from one brightness to its double."""


class Brightness(QObject):
    """Brightness of both images, of previews and of saved pictures.

    It is that of the light, where there is one, and changes neither the TF nor what is computed
    about it. Until it is chosen, it is the usual one of the light. Where model and reference have
    different light, each has its own usual one, and both are changed by the same factor. A choice
    is undone among the edits.
    """

    changed = Signal()

    def __init__(
        self,
        preferences: Preferences,
        parent: QObject | None = None,
        state: ViewerState | None = None,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._before: tuple[float | None] | None = None
        """Choice before a drag, in a tuple; None without a drag."""
        self._preferences = preferences
        self._chosen: float | None = None
        self._usual: dict[EngineName, float] = {"exact": 1.0, "learned": 1.0}
        self._fingerprint = ""
        self._series: object = None

    @property
    def value(self) -> float:
        """Brightness of the reference, :data:`DARKEST` to :data:`BRIGHTEST`; 1 changes nothing."""
        return self._usual["exact"] if self._chosen is None else self._chosen

    def of(self, engine: EngineName) -> float:
        """Return the brightness of an engine's images, under its own light."""
        return self.value * self._usual[engine] / self._usual["exact"]

    @property
    def is_chosen(self) -> bool:
        """True if it was chosen, False for the usual one of the light."""
        return self._chosen is not None

    def set(self, value: float | None) -> None:
        """Set the factor, within its limits; None for the usual one. It is one undo step."""
        self._before = self._before or (self._chosen,)
        self._choose(_limited(value))
        self._finish("brightness")

    def usual(self, engine: EngineName) -> float:
        """Return the usual brightness of an engine's images."""
        return self._usual[engine]

    def expose(self, factor: float) -> None:
        """Show images this much brighter than usual; 1 for the usual brightness."""
        self.set(None if factor == 1 else factor * self._usual["exact"])

    def move(self, step: int) -> None:
        """Set the factor by the step of a slider that is dragged."""
        self._before = self._before or (self._chosen,)
        self._choose(_limited(_value_of(step)))

    def finish(self) -> None:
        """End a drag, if there is one: one undo step."""
        self._finish(None)

    def _finish(self, merge_key: str | None) -> None:
        before, self._before = self._before, None
        if before is None or before[0] == self._chosen:
            return
        if self._state is not None and self._fingerprint:
            self._state.edits.change(self._show, before[0], self._chosen, "brightness", merge_key)
        else:
            self._show(self._chosen)

    def _show(self, value: float | None) -> None:
        self._choose(value)
        if self._fingerprint:
            self._preferences.note_volume(self._fingerprint, brightness=value)

    def set_lighting(self, engine: EngineName, lighting: Lighting) -> None:
        """Follow the light of an engine's images: of the reference, or of the model."""
        usual = usual_brightness(lighting)
        if usual != self._usual[engine]:
            self._usual[engine] = usual
            self.changed.emit()

    def start_volume(self, opened: OpenedVolume) -> None:
        """Show a volume as bright as the last time; the next time step as the one before."""
        before, self._series = self._series, opened.volume.series
        self._before = None
        self._fingerprint = opened.fingerprint
        known = self._preferences.volume(opened.fingerprint).brightness
        if known is not None or before != self._series:
            self._choose(known)
        elif self._chosen is not None:
            self._preferences.note_volume(self._fingerprint, brightness=self._chosen)

    def _choose(self, value: float | None) -> None:
        if value != self._chosen:
            self._chosen = value
            self.changed.emit()

    @property
    def step(self) -> int:
        """Nearest step of a slider; 0 for a factor of 1."""
        return round(STEPS_PER_OCTAVE * math.log2(self.value))

    def set_step(self, step: int) -> None:
        """Set the factor by the step of a slider."""
        self.set(_value_of(step))


def _value_of(step: int) -> float:
    return round(2.0 ** (step / STEPS_PER_OCTAVE), 3)


def _limited(value: float | None) -> float | None:
    return None if value is None else min(max(value, DARKEST), BRIGHTEST)
