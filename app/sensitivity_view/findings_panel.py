"""Panel of findings: edits that show most, values of a place or region, what if."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QTimer, Signal
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from app.controls import ElidedLabel, quiet_button
from app.glosses import explain, gloss
from app.sensitivity_view.add_button import AddButton
from app.sensitivity_view.field_bar import FieldBar
from app.sensitivity_view.held_button import HeldButton
from app.sensitivity_view.listed_values import ListedValues
from app.sensitivity_view.measured_edits import MeasuredEdits
from app.sensitivity_view.response_layer import ResponseLayer
from app.state.sensitivity_answers import SOURCE_NAMES, WhatIfAnswer
from app.state.sensitivity_dispatcher import BAND_REST_MS, SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.number_box import NumberBox
from model.scene.tf_emphasis import (
    add_mode,
    add_striking_mode,
    isolate_value,
    lower_value,
    raise_value,
)
from model.scene.tf_perturbation import edit_around
from model.scene.transfer_function import TF_SAMPLES, OpacityTF
from model.scene.value_text import range_text, value_text

PANEL_WIDTH = 300
ROWS = 3

MIXED = 3.0
"""Ratio of the size of a change to that of the mean brightness from which both are said."""

WHAT_IF_TIP = (
    "Show what a mode at the value under the mouse (or where the curve is highest) would change: "
    "click to see it until the next click, or hold (W)"
)


class FindingsPanel(QWidget):
    """Lists the edits that show most, or the values of the clicked place or of the region.

    Parameters
    ----------
    state : ViewerState
    sensitivity : SensitivityState
    dispatcher : SensitivityDispatcher
    layer : ResponseLayer
        Finds the intervals, and has flags for them.
    measured : MeasuredEdits
    shown_colors : callable
        Returns the colours (n, 3) that the active region shows now.
    source : QWidget
        Says who answered.
    visible : QWidget
        Says what is visible.
    """

    whatIfShown = Signal(object)
    """Emitted with a :class:`WhatIfAnswer` while the button is held."""
    whatIfEnded = Signal()

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        dispatcher: SensitivityDispatcher,
        layer: ResponseLayer,
        measured: MeasuredEdits,
        shown_colors: Callable[[], NDArray[np.float32]],
        source: QWidget,
        visible: QWidget,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._sensitivity = sensitivity
        self._dispatcher = dispatcher
        self._layer = layer
        self._measured = measured
        self._shown_colors = shown_colors
        self.values = ListedValues(state, sensitivity, dispatcher, ROWS, self)
        self._band_rest = QTimer(self, singleShot=True, interval=BAND_REST_MS)
        self._what_if: dict[str, WhatIfAnswer] = {}
        self._tried = 0.0
        self.setFixedWidth(PANEL_WIDTH)
        self.heading = QLabel()
        self.heading.setProperty("role", "title")
        self.values_button = quiet_button(
            "Values",
            "List the values that are visible in the region, to raise or lower them, or to show "
            "some alone;\nonce more, or Escape: back to the edits",
        )
        self.values_button.setCheckable(True)
        self.rows = [QLabel() for _ in range(ROWS)]
        self.adds = [AddButton("this value") for _ in range(ROWS)]
        self.raises = [quiet_button("▲", "Raise the opacity of these values") for _ in range(ROWS)]
        self.lowers = [quiet_button("▼", "Lower the opacity of these values") for _ in range(ROWS)]
        self.isolates = [quiet_button("only", "Show these values alone") for _ in range(ROWS)]
        self.height_box = NumberBox()
        self.height_box.setFixedWidth(56)
        self.height_box.show_value(sensitivity.choices.height)
        self.height_box.setToolTip("Opacity of the modes whose effect is listed")
        self.what_if_button = HeldButton("What if")
        self.field_bar = FieldBar(sensitivity, self._best_value)
        self.result = ElidedLabel()
        self.result.setProperty("role", "dim")
        self._said = QStackedWidget()
        self._said.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)
        self._lay_out(source, visible)
        self._connect()
        self.refresh()

    def add_mode(self, index: int, striking: bool = False) -> None:
        """Add a mode in an interval, if wanted in a colour that stands out: one undo step."""
        intervals = self._layer.intervals
        fresh = self._dispatcher.is_fresh(self._dispatcher.region_answer)
        if index < len(intervals) and fresh:
            self._add(intervals[index].value, self._width(), striking)

    def add_mode_over_band(self, striking: bool = False) -> None:
        """Add a mode over the band, if wanted in a colour that stands out: one undo step."""
        band = self._sensitivity.band
        if band is not None:
            width = self._width() + (band.high - band.low) / 4
            self._add((band.low + band.high) / 2, width, striking)

    def _add(self, value: float, width: float, striking: bool) -> None:
        tf, height = self._state.transfer_function, self._sensitivity.choices.height
        if striking:
            added = add_striking_mode(tf, value, width, height, self._shown_colors())
        else:
            added = replace(tf, opacity=add_mode(tf.opacity, value, width, height))
        self._state.commit(added, "add mode")

    def refresh(self) -> None:
        """Show the present edits or values; what is not up to date is dim."""
        dispatcher, values = self._dispatcher, self.values.is_listed
        fresh = self.values.is_fresh if values else dispatcher.is_fresh(dispatcher.region_answer)
        self.heading.setText(self.values.heading if values else "Where an edit shows most")
        self.values_button.setChecked(values)
        for index in range(ROWS):
            here = index < len(self.values.found if values else self._layer.intervals)
            text = ""
            if here:
                text = self._found_text(index) if values else self._interval_text(index)
            self.rows[index].setText(text)
            self.rows[index].setEnabled(fresh)
            self.adds[index].setVisible(here and not values)
            for buttons in (self.raises, self.lowers, self.isolates):
                buttons[index].setVisible(here and values)
            for button in (
                self.adds[index], self.raises[index], self.lowers[index], self.isolates[index],
            ):  # fmt: skip
                button.setEnabled(fresh)
        if not self.rows[0].text():
            self.rows[0].setText(self._nothing_text(values, fresh))
        self.field_bar.fade.setVisible(dispatcher.learned_fits)
        self._enable_what_if()

    def _nothing_text(self, values: bool, fresh: bool) -> str:
        if fresh:
            if values:
                return "nothing: it is black"
            # Or it only rises towards values that hardly any voxel has: see the curve.
            return (
                "no edit shows here"
                if self._layer.is_flat
                else "no value stands out: see the curve"
            )
        waiting = (
            bool(self._dispatcher.chooser.available) if values else self._dispatcher.is_waiting
        )
        if not waiting:
            return ""
        slow = not values and self._dispatcher.exact_source == "differences"
        return "computing some 90 images …" if slow else "computing …"

    def _enable_what_if(self) -> None:
        lacking = ""
        if not self._dispatcher.chooser.available:
            lacking = "Switch Sensitivity on first"
        elif self._what_if_edit() is None:
            lacking = "Point at a value in the plot of the TF first"
        self.what_if_button.setEnabled(not lacking)
        self.what_if_button.setToolTip(_tip(WHAT_IF_TIP, lacking))

    def start_what_if(self) -> None:
        """Have the edit at the band, or at the best interval, rendered."""
        edit = self._what_if_edit()
        if edit is not None and self._dispatcher.trials.ask_what_if(edit):
            lo, hi = self._state.scalar_range
            self._tried = lo + (hi - lo) * int(edit.argmax()) / (TF_SAMPLES - 1)
            self.what_if_button.setChecked(True)
            self._what_if.clear()
            self._say("rendering …")

    def leave_what_if(self) -> bool:
        """Show the fields again; return False if they are."""
        was_shown = self.what_if_button.isChecked()
        self.end_what_if()
        return was_shown

    def end_what_if(self) -> None:
        """Show the fields again; the numbers stay."""
        if self.what_if_button.isChecked():
            self.what_if_button.setChecked(False)
            self._band_rest.stop()
            self.whatIfEnded.emit()

    def _lay_out(self, source: QWidget, visible: QWidget) -> None:
        # As high with any of the buttons, so that the images above keep their size.
        some = self.adds[0], self.raises[0], self.isolates[0], self.values_button
        tallest = max(button.sizeHint().height() for button in some)
        head = QHBoxLayout()
        self.heading.setMinimumHeight(tallest)
        head.addWidget(self.heading)
        head.addStretch()
        head.addWidget(self.values_button)
        grid = QGridLayout()
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(2)
        grid.setHorizontalSpacing(4)
        grid.setColumnStretch(0, 1)
        for index, row in enumerate(self.rows):
            explain(row)
            row.setMinimumHeight(tallest)
            grid.addWidget(row, index, 0)
            row_buttons = (
                self.adds[index],
                self.raises[index],
                self.lowers[index],
                self.isolates[index],
            )
            for column, button in enumerate(row_buttons, start=1):
                grid.addWidget(button, index, column)
        height = QHBoxLayout()
        label = QLabel("Edits of opacity")
        label.setProperty("role", "dim")
        label.setToolTip(self.height_box.toolTip())
        for widget in (label, self.height_box, self.what_if_button):
            height.addWidget(widget)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addLayout(head)
        # A result takes the place of who answered: whatever else is there keeps its own.
        for line in (source, self.result):
            self._said.addWidget(line)
        layout.addWidget(self._said)
        layout.addWidget(visible)
        layout.addLayout(grid)
        layout.addStretch()
        layout.addLayout(height)
        layout.addWidget(self.field_bar)

    def _connect(self) -> None:
        sensitivity = self._sensitivity
        for index in range(ROWS):
            self.adds[index].addRequested.connect(
                lambda striking, i=index: self.add_mode(i, striking)
            )
            self.raises[index].clicked.connect(lambda _=False, i=index: self._emphasize(i, "raise"))
            self.lowers[index].clicked.connect(lambda _=False, i=index: self._emphasize(i, "lower"))
            self.isolates[index].clicked.connect(
                lambda _=False, i=index: self._emphasize(i, "isolate")
            )
        self._layer.peakClicked.connect(self.add_mode)
        self._layer.intervalsChanged.connect(lambda _intervals: self._forget_result())
        self._measured.changed.connect(self.refresh)
        self.values.changed.connect(self.refresh)
        trials = self._dispatcher.trials
        trials.whatIfAnswered.connect(self._take_what_if)
        trials.dropped.connect(self._say)
        self._dispatcher.regionAnswered.connect(self.refresh)
        self._state.inputsChanged.connect(self._forget_result)
        sensitivity.regionsChanged.connect(self._forget_result)
        self.values_button.clicked.connect(self._list_values)
        self.what_if_button.turnedOn.connect(self.start_what_if)
        self.what_if_button.turnedOff.connect(self.end_what_if)
        self.height_box.valueChanged.connect(lambda height: sensitivity.choose(height=height))
        self.field_bar.addRequested.connect(self.add_mode_over_band)
        sensitivity.choicesChanged.connect(lambda _choices: self._forget_result())
        sensitivity.bandChanged.connect(lambda _band: self._follow_band())
        self._band_rest.timeout.connect(self.start_what_if)

    def _list_values(self, wanted: bool) -> None:
        if wanted:
            self.values.list_region()
        else:
            self.values.leave()

    def _best_value(self) -> float | None:
        return self._layer.intervals[0].value if self._layer.intervals else None

    def _width(self) -> float:
        """Standard deviation of edits in the data's units."""
        lo, hi = self._state.scalar_range
        return self._sensitivity.choices.width * (hi - lo) / (TF_SAMPLES - 1)

    def _what_if_edit(self) -> NDArray[np.float32] | None:
        edit, value = self._dispatcher.edit(), self._best_value()
        if edit is None and value is None:
            value = self._layer.strongest
        if edit is None and value is not None:
            width = self._sensitivity.choices.width
            edit = edit_around(value, self._state.scalar_range, width)
        return edit

    def _emphasize(self, index: int, how: str) -> None:
        if index >= len(self.values.found):
            return
        tf, found = self._state.transfer_function, self.values.found[index]
        functions: dict[str, Callable[[OpacityTF, float, float], OpacityTF]] = {
            "raise": raise_value,
            "lower": lower_value,
            "isolate": partial(isolate_value, reach=found.reach),
        }
        opacity = functions[how](tf.opacity, found.value, self._width())
        self._state.commit(replace(tf, opacity=opacity), f"{how} value")

    def _follow_band(self) -> None:
        """Have what is asked for at another value rendered, and forget what was not."""
        self._enable_what_if()
        if self.what_if_button.isChecked():
            self._band_rest.start()
        else:
            self._say("")

    def _say(self, result: str) -> None:
        self.result.set_full_text(result)
        self._said.setCurrentIndex(1 if result else 0)

    def _forget_result(self) -> None:
        self._say("")
        self.refresh()

    def _take_what_if(self, answer: WhatIfAnswer) -> None:
        self._what_if[SOURCE_NAMES[answer.source]] = answer
        texts = []
        for name, one in self._what_if.items():
            predicted = one.what_if.predicted
            said = "" if predicted is None else f" (promised {predicted:.3f})"
            texts.append(f"{name} changes {one.what_if.rmse:.3f}{said}")
        self._say(f"At {self._text(self._tried)}: {', '.join(texts)}")
        if self.what_if_button.isChecked():
            self.whatIfShown.emit(answer)

    def _text(self, value: float) -> str:
        return value_text(value, self._state.scalar_range, self._state.scale)

    def _interval_text(self, index: int) -> str:
        interval = self._layer.intervals[index]
        predicted = self._effect(interval.predicted(self._sensitivity.choices.height))
        measured = self._measured.found(interval)
        if measured is None:
            effect = "…"
        elif self._sensitivity.choices.measure == "change":
            effect = self._effect(measured.rmse)
        else:
            effect = self._effect(measured.brightness)
            if measured.rmse > MIXED * abs(measured.brightness):
                effect += f" ({gloss('±')}{measured.rmse:.2g})"
        self.rows[index].setToolTip(
            f"{self._text(interval.low)} to {self._text(interval.high)}: a mode of this opacity "
            "changes the region's pixels\nby so much (1 is from black to white), rendered and "
            "shown in the present brightness.\n(±): so much on the average where some become "
            f"brighter and others darker.\nThe curve, of faint edits, promises: {predicted}."
        )
        text = f"{index + 1}   {self._text(interval.value)}   {effect}"
        # Rich text would swallow the spaces.
        return f"<span style='white-space: pre'>{text}</span>" if "<" in text else text

    def _effect(self, change: float) -> str:
        if self._sensitivity.choices.measure == "change":
            return f"changes {change:.2g}"
        return f"{'brighter' if change > 0 else 'darker'} {change:+.2g}"

    def _found_text(self, index: int) -> str:
        found = self.values.found[index]
        self.rows[index].setToolTip("Share of what is visible there")
        reach = range_text(found.reach, self._state.scalar_range, self._state.scale)
        return f"{reach}   {100 * found.share:.0f} %"


def _tip(text: str, lacking: str) -> str:
    """Return a tooltip; where something is lacking, it comes first."""
    return f"{lacking}.\n{text}" if lacking else text
