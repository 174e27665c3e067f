"""Brightness of the images: a factor of their colours, kept for each volume."""

from __future__ import annotations

import math

from PySide6.QtCore import QObject, Signal

from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences

DARKEST, BRIGHTEST = 0.25, 4.0

STEPS_PER_OCTAVE = 8
"""Steps of a slider from one brightness to its double."""


class Brightness(QObject):
    """Factor of the colours of both images, of previews and of saved pictures.

    It is that of the light, where there is one, and changes neither the TF nor what is computed
    about it.

    Parameters
    ----------
    preferences : Preferences
    """

    changed = Signal(float)

    def __init__(self, preferences: Preferences, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._preferences = preferences
        self._value = 1.0
        self._fingerprint = ""
        self._series: object = None

    @property
    def value(self) -> float:
        """The factor, :data:`DARKEST` to :data:`BRIGHTEST`; 1 shows images as they are."""
        return self._value

    def set(self, value: float) -> None:
        """Set the factor, within its limits."""
        value = min(max(value, DARKEST), BRIGHTEST)
        if value != self._value:
            self._value = value
            if self._fingerprint:
                self._preferences.note_volume(self._fingerprint, brightness=value)
            self.changed.emit(value)

    def start_volume(self, opened: OpenedVolume) -> None:
        """Show a volume as bright as the last time; the next time step as the one before."""
        before, self._series = self._series, opened.volume.series
        self._fingerprint = opened.fingerprint
        known = self._preferences.volume(opened.fingerprint).brightness
        if known != 1 or before != self._series:
            self.set(known)

    @property
    def step(self) -> int:
        """Nearest step of a slider; 0 for a factor of 1."""
        return round(STEPS_PER_OCTAVE * math.log2(self.value))

    def set_step(self, step: int) -> None:
        """Set the factor by the step of a slider."""
        self.set(round(2.0 ** (step / STEPS_PER_OCTAVE), 3))
