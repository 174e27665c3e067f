"""What an edit would change, rendered without being made, for as long as it is asked."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QElapsedTimer, QObject, QTimer, Signal
from PySide6.QtWidgets import QPushButton, QWidget

from app.sensitivity_view.response_layer import ResponseLayer
from app.short_numbers import short
from app.state.sensitivity_answers import WhatIfAnswer
from app.state.sensitivity_asker import BAND_REST_MS, SensitivityAsker
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.mode_card import WIDTHS
from model.scene.tf_perturbation import edit_around, edit_over
from model.scene.transfer_function import TF_SAMPLES
from model.scene.value_text import range_text

CLICK_MS = 350
"""Time up to which a press is a click; the button is held if it takes longer."""


class HeldButton(QPushButton):
    """Asks for something to be shown as long as it is held; a click lasts until the next one.

    Whoever shows it checks the button, and unchecks it when it is no longer shown.
    """

    turnedOn = Signal()
    turnedOff = Signal()

    def __init__(self, text: str, parent: QWidget | None = None) -> None:
        super().__init__(text, parent)
        self.setCheckable(True)
        self._held = QElapsedTimer()
        self.pressed.connect(self._press)
        self.released.connect(self._release)

    def nextCheckState(self) -> None:
        """Stay as it is when clicked: on or off is not for the button to decide."""

    def _press(self) -> None:
        if self.isChecked():
            self._held.invalidate()
            self.turnedOff.emit()
        else:
            self._held.start()
            self.turnedOn.emit()

    def _release(self) -> None:
        if self._held.isValid() and self._held.elapsed() > CLICK_MS:
            self.turnedOff.emit()


TIP = (
    "Render a mode at the value under the mouse, or at the highest peak of the curve. Click to "
    "switch it on and off, or hold W."
)


class WhatIfQuestion(QObject):
    """Has an edit rendered while its button is on, and follows the band of values with it.

    Attributes
    ----------
    edit_text : str
        Size, place and width of the edit that was asked about last, in words.
    result : str
        What the edit changes, in a sentence; empty if nothing was asked.
    """

    shown = Signal(object)
    """Emitted with a :class:`WhatIfAnswer` while it is asked."""
    ended = Signal()
    resultChanged = Signal(str)

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        asker: SensitivityAsker,
        layer: ResponseLayer,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._sensitivity = sensitivity
        self._asker = asker
        self._layer = layer
        self._answers: dict[str, WhatIfAnswer] = {}
        self.edit_text = self._at = ""
        self.result = ""
        self.button = HeldButton("What if  W")
        self.button.setAccessibleName("What if")
        self._band_rest = QTimer(self, singleShot=True, interval=BAND_REST_MS)
        self._band_rest.timeout.connect(self.start)
        self.button.turnedOn.connect(self.start)
        self.button.turnedOff.connect(self.end)
        asker.whatIfAnswered.connect(self._take)
        sensitivity.bandChanged.connect(lambda _band: self._follow_band())
        sensitivity.choicesChanged.connect(lambda _choices: self._say(""))
        for changed in (state.inputsChanged, sensitivity.regionsChanged, layer.intervalsChanged):
            changed.connect(self._forget)
        # What the edit would do to another image is another question.
        state.inputsChanged.connect(lambda *_: self.end())
        self.enable()

    def enable(self) -> None:
        """Enable the button if there is something to ask; if not, it says what is missing."""
        lacking = ""
        if not self._asker.engines:
            lacking = "Switch Region > Guidance on first"
        elif self._edit() is None:
            lacking = "Point at a value in the plot of the TF first"
        self.button.setEnabled(not lacking)
        # What is lacking comes first.
        self.button.setToolTip(f"{lacking}.\n{TIP}" if lacking else TIP)

    def start(self) -> None:
        """Have the edit at the band, or at the best interval, rendered."""
        edit = self._edit()
        if edit is not None and self._asker.ask_what_if(edit):
            self._note_edit(edit)
            self.button.setChecked(True)
            self._answers.clear()
            self._say("rendering …")

    def leave(self) -> bool:
        """Show the fields again; return False if they are."""
        was_shown = self.button.isChecked()
        self.end()
        return was_shown

    def end(self) -> None:
        """Show the fields again; the numbers stay."""
        if self.button.isChecked():
            self.button.setChecked(False)
            self._band_rest.stop()
            self.ended.emit()

    def _note_edit(self, edit: NDArray[np.float32]) -> None:
        """Say where an edit is, how high, and how wide: as the numbers of a mode say it."""
        band, choices = self._sensitivity.band, self._sensitivity.choices
        lo, hi = self._state.scalar_range
        step = (hi - lo) / (TF_SAMPLES - 1)
        top = lo + step * int(edit.argmax())
        values = (top, top) if band is None or band.low == band.high else band.values
        self._at = range_text(values, (lo, hi), self._state.scale)
        width = short(math.sqrt(2) * choices.width * step, 3)
        self.edit_text = (
            f"{short(choices.height, signed=True)} opacity at {self._at}, "
            f"{WIDTHS[self._state.scale]} {width}"
        )

    def _edit(self) -> NDArray[np.float32] | None:
        band, layer = self._sensitivity.band, self._layer
        scalar_range, width = self._state.scalar_range, self._sensitivity.choices.width
        if band is not None:
            return edit_over(band.values, scalar_range, width)
        value = layer.intervals[0].value if layer.intervals else layer.strongest
        return None if value is None else edit_around(value, scalar_range, width)

    def _follow_band(self) -> None:
        """Have what is asked for at another value rendered, and forget what was not."""
        self.enable()
        if self.button.isChecked():
            self._band_rest.start()
        else:
            self._say("")

    def _forget(self, *_changed: object) -> None:
        if self.result:
            self._say("")

    def _say(self, result: str) -> None:
        self.result = result
        self.resultChanged.emit(result)

    def _take(self, answer: WhatIfAnswer | str) -> None:
        if isinstance(answer, str):
            self._say(answer)
            return
        self._answers[answer.source] = answer
        texts = []
        for name, one in self._answers.items():
            predicted = one.what_if.predicted
            said = "" if predicted is None else f" (predicted {predicted:.3f})"
            texts.append(f"{name} changes {one.what_if.rmse:.3f}{said}")
        self._say(f"At {self._at}: {', '.join(texts)}")
        if self.button.isChecked():
            self.shown.emit(answer)
