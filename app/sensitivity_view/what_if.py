"""Edits that findings suggest: made, or only rendered (*What if*)."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QElapsedTimer, QObject
from PySide6.QtWidgets import QPushButton

from app.engines.background import Pause
from app.engines.client import Channels, EngineName
from app.engines.messages import Result
from app.engines.requests import BatchRequest
from app.number_box import short
from app.sensitivity_view.findings import MOST, brightness_text, change_text
from app.sensitivity_view.response_layer import ResponseLayer
from app.state.sensitivity_asker import BAND_REST_MS, SensitivityAsker, Source
from app.tf_editor.unit_axis import WIDTHS
from model.rendering.brightness import brighten
from model.scene.region import Outline
from model.scene.tf_emphasis import (
    add_mode,
    add_striking_mode,
    isolate_value,
    lower_value,
    raise_value,
)
from model.scene.tf_perturbation import edit_around, edit_over
from model.scene.transfer_function import TF_SAMPLES, OpacityTF
from model.sensitivity.peaks import Contribution, is_same_value
from model.sensitivity.what_if import WhatIf, compare, edited, predicted_rmse

CLICK_MS = 350  # time up to which a press is a click; the button is held if it takes longer

TIP = (
    "Render a mode at the value under the mouse, or at the highest peak of the curve. Click to "
    "switch it on and off, or hold W."
)


@dataclass(frozen=True, eq=False)
class RenderedEdit:
    """An edit that one engine has rendered."""

    what_if: WhatIf
    source: Source


class HeldButton(QPushButton):
    """Button that is on while it is held; a click switches it on until the next click."""

    def __init__(self, text: str, turn: Callable[[bool], object]) -> None:
        super().__init__(text)
        self.setCheckable(True)
        self._turn = turn
        self._held = QElapsedTimer()
        self.pressed.connect(self._press)
        self.released.connect(self._release)

    def nextCheckState(self) -> None:
        """Do not toggle on a click: others decide whether it is on."""

    def _press(self) -> None:
        is_on = self.isChecked()
        self._held.invalidate()
        if not is_on:
            self._held.start()
        self._turn(not is_on)

    def _release(self) -> None:
        if self._held.isValid() and self._held.elapsed() > CLICK_MS:
            self._turn(False)


class WhatIfQuestion(QObject):
    """Renders an edit while its button is on; the edit follows the band of values."""

    def __init__(
        self,
        asker: SensitivityAsker,
        layer: ResponseLayer,
        changed: Callable[[], object],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._asker, self._layer, self._changed = asker, layer, changed
        self._channels = Channels(asker.clients, "what if", self._take, self)
        self._edited: tuple[Outline, NDArray[np.float32]] | None = None
        """Region and edit that were asked about last."""
        self._answers: dict[str, RenderedEdit] = {}
        self.shown: RenderedEdit | None = None
        self.edit_text = self._at = ""  # of the edit that was asked about last, in words
        self.result = ""  # what the edit changes, in a sentence
        self.button = HeldButton("What if  W", lambda on: self.start() if on else self.end())
        self.button.setAccessibleName("What if")
        self._band_rest = Pause(self, BAND_REST_MS, self.start)

    @property
    def is_on(self) -> bool:
        """Whether it is asked for."""
        return self.button.isChecked()

    def enable(self) -> None:
        """Enable the button if an edit can be rendered; else its tooltip says what is missing."""
        lacking = ""
        if not self._asker.engines:
            lacking = "Choose Region > Show sensitivity first"
        elif self._edit() is None:
            lacking = "Point at a value in the plot of the TF first"
        self.button.setEnabled(not lacking)
        # The missing part comes first.
        self.button.setToolTip(f"{lacking}.\n{TIP}" if lacking else TIP)

    def start(self) -> None:
        """Render the edit at the band, or at the best interval."""
        edit, asker = self._edit(), self._asker
        if edit is None or not asker.engines:
            self.end()
            return
        self._edited, inputs = (asker.asked.outline, edit), asker.state.inputs
        after = edited(inputs, edit, asker.asked.choices.height)
        for name in asker.engines:
            quality = asker.sized(name, asker.rest_size)
            self._channels[name].ask(BatchRequest(inputs, quality, (after,)))
        self._note_edit(edit)
        self.button.setChecked(True)
        self._answers.clear()
        self._say("rendering …")

    def end(self) -> None:
        """Show the fields again; the numbers stay."""
        if self.is_on:
            self.button.setChecked(False)
            self._band_rest.stop()
            self.shown = None
            self._changed()

    def forget(self) -> None:
        """Forget the answer about another region, image or measure; ask again while it is on."""
        self._channels.cancel()
        if self.result:
            self._say("")
        if self.is_on:
            self._band_rest.start()

    def follow_band(self) -> None:
        """Render the edit at another value; forget an answer that is not wanted any more."""
        self.enable()
        # The next answer would be about the previous values.
        self._channels.cancel()
        if self.is_on:
            self._band_rest.start()
        else:
            self._say("")

    def _take(self, name: EngineName, result: Result) -> None:
        if self._channels[name].is_pending or self._edited is None:
            return
        asker = self._asker
        if result.value is None or result.request.inputs != asker.state.inputs:
            self._say(result.error or "")
            return
        source, (outline, edit), predicted = asker.source(name), self._edited, None
        field = asker.fields.get(source)
        brightness = asker.state.brightness.of(asker.state.lit(name))
        if brightness == 1 and field and field.is_of(asker.state.inputs):
            of = field.request
            if np.array_equal(edit_over(of.values, asker.state.scalar_range, of.width), edit):
                predicted = predicted_rmse(field.value, edit, asker.asked.choices.height, outline)
        # Compared as shown: the brightness determines which parts are visible.
        colors = np.clip(result.value[..., :3], 0, 1)
        brighten(colors, brightness)
        found = compare(colors[0], colors[1], outline.mask(colors.shape[1:3]), predicted)
        answer = self._answers[source] = RenderedEdit(found, source)
        if self.is_on:
            self.shown = answer
        # The exact one first, whichever engine answers first.
        answers = sorted(self._answers.values(), key=lambda each: each.source == "learned")
        over = ", over black" * self._asker.asked.over_bright
        self._say(f"At {self._at}{over}: {', '.join(map(_said, answers))}")

    def _note_edit(self, edit: NDArray[np.float32]) -> None:
        """Describe an edit by value, opacity and width, as the numbers of a mode do."""
        state, band, choices = self._asker.state, self._asker.asked.band, self._asker.asked.choices
        lo, hi = state.scalar_range
        step = (hi - lo) / (TF_SAMPLES - 1)
        top = lo + step * int(edit.argmax())
        values = (top, top) if band is None else band.values
        self._at = state.range_text(values)
        width = short(math.sqrt(2) * choices.width * step, 3)
        self.edit_text = (
            f"{short(choices.height, signed=True)} opacity at {self._at}, "
            f"{WIDTHS[state.scale]} {width}"
        )

    def _edit(self) -> NDArray[np.float32] | None:
        asked, layer = self._asker.asked, self._layer
        scalar_range, width = self._asker.state.scalar_range, asked.choices.width
        if asked.band is not None:
            return edit_over(asked.band.values, scalar_range, width)
        peaks, listed = layer.peaks, self._asker.listed
        value = peaks.intervals[0].value if peaks.intervals else peaks.strongest
        if asked.active is None and listed:
            value = listed[0].value
        return None if value is None else edit_around(value, scalar_range, width)

    def _say(self, result: str) -> None:
        self.result = result
        self._changed()


def _said(answer: RenderedEdit) -> str:
    predicted = answer.what_if.predicted
    said = "" if predicted is None else f"; predicted {change_text(predicted, MOST)}"
    return f"{effect_text(answer.what_if)} ({answer.source}{said})"


def effect_text(found: WhatIf) -> str:
    """Write what an edit does to the region."""
    return f"{brightness_text(found.brighter)}, RMS change {change_text(found.rmse)}"


Emphasis = Literal["raise", "lower", "isolate"]


class EditActions:
    """Makes edits, each as one undo step."""

    def __init__(
        self,
        asker: SensitivityAsker,
        layer: ResponseLayer,
        shown_colors: Callable[[], NDArray[np.float32]],
        made_visible: Callable[[OpacityTF], OpacityTF],
        say: Callable[[str], object],
    ) -> None:
        self._asker, self._layer = asker, layer
        self._state, self._asked = asker.state, asker.asked
        self._shown_colors, self._made_visible, self._say = shown_colors, made_visible, say
        self._ways_back: dict[tuple[Emphasis, OpacityTF], tuple[float, OpacityTF]] = {}
        """Value and TF to return to, by the edit that would undo another and the TF after that."""

    def add_mode(self, index: int, striking: bool = False) -> None:
        """Add a mode in an interval, optionally in a colour that stands out."""
        intervals = self._layer.peaks.intervals
        if index < len(intervals) and self._asker.is_fresh(self._asker.region):
            self._add(intervals[index].value, self._width, striking)

    def add_mode_over_band(self, striking: bool = False) -> None:
        """Add a mode over the band, optionally in a colour that stands out."""
        band = self._asked.band
        if band is not None:
            width = self._width + (band.high - band.low) / 4
            self._add((band.low + band.high) / 2, width, striking)

    def emphasize(self, found: Contribution, how: Emphasis) -> None:
        """Raise or lower the opacity of values, or show them alone, opaque enough to be seen."""
        tf, value, width = self._state.transfer_function, found.value, self._width
        if how == "isolate":
            opacity = self._made_visible(isolate_value(tf.opacity, value, width, found.reach))
            # The image may hardly change.
            self._say(f"Only the values {self._state.range_text(found.reach)} are shown now.")
        else:
            known = self._ways_back.get((how, tf.opacity))
            if known is not None and is_same_value(known[0], value, self._state.scalar_range):
                opacity = known[1]
            else:
                step = raise_value if how == "raise" else lower_value
                opacity = step(tf.opacity, value, width, found.reach)
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
