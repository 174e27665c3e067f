"""Edits that findings lead to: a mode at a value or over a band, values raised, lowered, alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from app.sensitivity_view.response_layer import ResponseLayer
from app.state.sensitivity_asker import SensitivityAsker
from model.scene.tf_emphasis import (
    add_mode,
    add_striking_mode,
    isolate_value,
    lower_value,
    raise_value,
)
from model.scene.transfer_function import TF_SAMPLES, OpacityTF
from model.sensitivity.peaks import Contribution, is_same_value

Emphasis = Literal["raise", "lower", "isolate"]


class EditActions:
    """Makes edits, each as one undo step.

    `shown_colors` returns the colours (n, 3) that the active region shows now, `made_visible` an
    opacity TF with opacities that show in the volume.
    """

    def __init__(
        self,
        asker: SensitivityAsker,
        layer: ResponseLayer,
        shown_colors: Callable[[], NDArray[np.float32]],
        made_visible: Callable[[OpacityTF], OpacityTF],
    ) -> None:
        self._asker, self._layer = asker, layer
        self._state, self._asked = asker.state, asker.asked
        self._shown_colors, self._made_visible = shown_colors, made_visible
        self._ways_back: dict[tuple[Emphasis, OpacityTF], tuple[float, OpacityTF]] = {}
        """For the edit that takes back the one that led to a TF: its value, and the TF before."""

    def add_mode(self, index: int, striking: bool = False) -> None:
        """Add a mode in an interval, if wanted in a colour that stands out."""
        intervals = self._layer.peaks.intervals
        if index < len(intervals) and self._asker.is_fresh(self._asker.region):
            self._add(intervals[index].value, self._width, striking)

    def add_mode_over_band(self, striking: bool = False) -> None:
        """Add a mode over the band, if wanted in a colour that stands out."""
        band = self._asked.band
        if band is not None:
            width = self._width + (band.high - band.low) / 4
            self._add((band.low + band.high) / 2, width, striking)

    def emphasize(self, found: Contribution, how: Emphasis) -> None:
        """Raise or lower the opacity of values, or show them alone, opaque enough to be seen.

        Raising and lowering are each other's inverse, as long as nothing else is changed.
        """
        tf, value, width = self._state.transfer_function, found.value, self._width
        if how == "isolate":
            alone = isolate_value(tf.opacity, value, width, found.reach)
            opacity = self._made_visible(alone)
        else:
            known = self._ways_back.get((how, tf.opacity))
            if known is not None and is_same_value(known[0], value, self._state.scalar_range):
                opacity = known[1]
            else:
                step = raise_value if how == "raise" else lower_value
                opacity = step(tf.opacity, value, width)
            if opacity != tf.opacity:
                self._ways_back["lower" if how == "raise" else "raise", opacity] = value, tf.opacity
        self._state.tf_input.set(replace(tf, opacity=opacity), f"{how} value")

    def _add(self, value: float, width: float, striking: bool) -> None:
        tf, height = self._state.transfer_function, self._asked.choices.height
        if striking:
            added = add_striking_mode(tf, value, width, height, self._shown_colors())
        else:
            added = replace(tf, opacity=add_mode(tf.opacity, value, width, height))
        self._state.tf_input.set(added, "add mode")

    @property
    def _width(self) -> float:
        """Standard deviation of edits in the data's units."""
        lo, hi = self._state.scalar_range
        return self._asked.choices.width * (hi - lo) / (TF_SAMPLES - 1)
