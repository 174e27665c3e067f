"""Brightness of the images: how bright they are shown."""

from __future__ import annotations

import math
from typing import Literal

from PySide6.QtCore import QObject

from app.engines.client import EngineName
from app.state.edits import EditedInput, EditHistory
from model.rendering.brightness import usual_brightness
from model.scene.scene import Lighting

DARKEST, BRIGHTEST = 0.25, 32.0  # limits; the greatest is that of an exposed picture of the map
STEPS_PER_OCTAVE = 8  # steps of a slider from one brightness to its double


Lit = EngineName | Literal["b"]  # whose light images have: an engine's, or that of B


class Brightness(EditedInput[float | None]):
    """Brightness of both images, of previews and of saved pictures, as chosen for the reference.

    It changes neither the TF nor what is computed about it. None is the usual one of the light.
    Where model and reference have different light, each has its own usual one, and a choice changes
    both by the same factor.
    """

    def __init__(self, history: EditHistory, parent: QObject) -> None:
        super().__init__(None, "brightness", history, parent)
        self._usual: dict[Lit, float] = {"exact": 1.0, "learned": 1.0, "b": 1.0}

    def of(self, engine: Lit) -> float:
        """Return the brightness of an engine's images under its own light; 1 changes nothing."""
        chosen = self._usual["exact"] if self.value is None else self.value
        return chosen * self._usual[engine] / self._usual["exact"]

    def usual(self, engine: Lit) -> float:
        """Return the usual brightness of an engine's images."""
        return self._usual[engine]

    def set(self, value: float | None, text: str = "", merge_key: str | None = None) -> None:
        """Choose a brightness, within its limits, as one edit with the last; None: the usual."""
        super().set(value, text, merge_key or "brightness")

    def expose(self, factor: float) -> None:
        """Show images this much brighter than usual; 1 for the usual brightness."""
        self.set(None if factor == 1 else factor * self._usual["exact"])

    def set_lighting(self, engine: Lit, lighting: Lighting) -> None:
        """Follow the light of an engine's images: of the reference, of the model, or of B."""
        usual = usual_brightness(lighting)
        if usual != self._usual[engine]:
            self._usual[engine] = usual
            self.changed.emit(self.value)

    @property
    def step(self) -> int:
        """Nearest step of a slider; 0 for a brightness of 1."""
        return round(STEPS_PER_OCTAVE * math.log2(self.of("exact")))

    def _normal(self, value: float | None) -> float | None:
        return None if value is None else min(max(value, DARKEST), BRIGHTEST)


def brightness_at(step: int) -> float:
    """Return the brightness at a step of a slider."""
    return round(2.0 ** (step / STEPS_PER_OCTAVE), 3)
