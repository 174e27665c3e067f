"""How bright the images are shown: a factor of their colours, kept between runs."""

from __future__ import annotations

import math

from PySide6.QtCore import QObject, Signal

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

    @property
    def value(self) -> float:
        """The factor, :data:`DARKEST` to :data:`BRIGHTEST`; 1 shows images as they are."""
        return float(self._preferences.value("brightness"))

    def set(self, value: float) -> None:
        """Set the factor, within its limits."""
        value = min(max(value, DARKEST), BRIGHTEST)
        if value != self.value:
            self._preferences.set(brightness=value)
            self.changed.emit(value)

    @property
    def step(self) -> int:
        """Nearest step of a slider; 0 for a factor of 1."""
        return round(STEPS_PER_OCTAVE * math.log2(self.value))

    def set_step(self, step: int) -> None:
        """Set the factor by the step of a slider."""
        self.set(round(2.0 ** (step / STEPS_PER_OCTAVE), 3))
