"""Panel of findings: edits that show most, values of a place or region, what if."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.controls import quiet_button, text_button
from app.sensitivity_view.field_bar import FieldBar
from app.sensitivity_view.held_button import HeldButton
from app.sensitivity_view.measured_edits import MeasuredEdits
from app.sensitivity_view.response_layer import ResponseLayer
from app.sensitivity_view.visible_label import VisibleLabel
from app.state.sensitivity_answers import SOURCE_NAMES, VisibilityAnswer, WhatIfAnswer
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from app.tf_editor.number_box import NumberBox
from model.scene.tf_emphasis import (
    add_striking_mode,
    isolate_value,
    lower_value,
    raise_value,
)
from model.scene.tf_perturbation import edit_around
from model.scene.transfer_function import TF_SAMPLES
from model.scene.value_text import value_text
from model.sensitivity.contributions import Contribution, contributions

PANEL_WIDTH = 300
ROWS = 3

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
    visible : VisibleLabel
        Says what is visible, and offers to list it.
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
        visible: VisibleLabel,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._sensitivity = sensitivity
        self._dispatcher = dispatcher
        self._layer = layer
        self._measured = measured
        self._shown_colors = shown_colors
        self._found: tuple[Contribution, ...] = ()
        self._lists_region = False
        self._what_if: dict[str, WhatIfAnswer] = {}
        self._tried = 0.0
        self.setFixedWidth(PANEL_WIDTH)
        self.heading = QLabel()
        self.heading.setProperty("role", "title")
        self.back = text_button("✕", "Back to the edits (Escape)")
        self.rows = [QLabel() for _ in range(ROWS)]
        self.adds = [QPushButton("Add") for _ in range(ROWS)]
        for button in self.adds:
            button.setToolTip("Add a mode at this value, in a colour that stands out")
            # After a click, keys such as R are the window's again.
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.raises = [quiet_button("▲", "Raise the opacity of this value") for _ in range(ROWS)]
        self.lowers = [quiet_button("▼", "Lower the opacity of this value") for _ in range(ROWS)]
        self.isolates = [quiet_button("only", "Show this value alone") for _ in range(ROWS)]
        self.height_box = NumberBox()
        self.height_box.setFixedWidth(56)
        self.height_box.show_value(sensitivity.choices.height)
        self.height_box.setToolTip("Opacity of the modes whose effect is listed")
        self.what_if_button = HeldButton("What if")
        self.field_bar = FieldBar(sensitivity, self._best_value)
        self.result = QLabel()
        self.result.setProperty("role", "dim")
        self.result.setWordWrap(True)
        self._visible = visible
        self._lay_out(source, visible)
        self._connect()
        self.refresh()

    def add_mode(self, index: int) -> None:
        """Add a mode in an interval, in a colour that stands out: one undo step."""
        intervals = self._layer.intervals
        fresh = self._dispatcher.is_fresh(self._dispatcher.region_answer)
        if index < len(intervals) and fresh:
            self._add(intervals[index].value, self._width())

    def add_mode_over_band(self) -> None:
        """Add a mode over the band, in a colour that stands out: one undo step."""
        band = self._sensitivity.band
        if band is not None:
            self._add((band.low + band.high) / 2, self._width() + (band.high - band.low) / 4)

    def _add(self, value: float, width: float) -> None:
        tf, height = self._state.transfer_function, self._sensitivity.choices.height
        added = add_striking_mode(tf, value, width, height, self._shown_colors())
        self._state.commit(added, "add mode")

    def leave_values(self) -> bool:
        """List the edits again; return False if they are."""
        if not self._lists_values:
            return False
        self._lists_region = False
        self._sensitivity.pick(None)
        self._find_values()
        return True

    def refresh(self) -> None:
        """Show the present edits or values; what is not up to date is dim."""
        dispatcher, values = self._dispatcher, self._lists_values
        fresh = dispatcher.is_fresh(dispatcher.region_answer)
        if values:
            fresh = self._values is not None and self._values.is_of(self._state.inputs)
        self.heading.setText(self._heading())
        self.back.setVisible(values)
        for index in range(ROWS):
            here = index < len(self._found if values else self._layer.intervals)
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

    @property
    def _lists_values(self) -> bool:
        """Whether the values of a place or of the region are listed."""
        return self._lists_region or self._sensitivity.place is not None

    @property
    def _values(self) -> VisibilityAnswer | None:
        """Visibility of the values that are listed; None while it is not known."""
        if self._sensitivity.place is not None:
            return self._dispatcher.pick
        answer, outline = self._dispatcher.visibility, self._sensitivity.outline
        return answer if answer is not None and answer.request.regions[0] == outline else None

    def _heading(self) -> str:
        if self._sensitivity.place is not None:
            return "At the clicked place"
        if self._lists_region:
            return f"Visible: {self._sensitivity.region_name.lower()}"
        return "Where an edit shows most"

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
            self.result.setText("rendering …")

    def end_what_if(self) -> None:
        """Show the fields again; the numbers stay."""
        if self.what_if_button.isChecked():
            self.what_if_button.setChecked(False)
            self.whatIfEnded.emit()

    def _lay_out(self, source: QWidget, visible: QWidget) -> None:
        # As high with any of the buttons, so that the images above keep their size.
        some = self.adds[0], self.raises[0], self.isolates[0], self.back
        tallest = max(button.sizeHint().height() for button in some)
        head = QHBoxLayout()
        self.heading.setMinimumHeight(tallest)
        head.addWidget(self.heading)
        head.addStretch()
        head.addWidget(self.back)
        grid = QGridLayout()
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setVerticalSpacing(2)
        grid.setHorizontalSpacing(4)
        grid.setColumnStretch(0, 1)
        for index, row in enumerate(self.rows):
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
        for widget in (label, self.height_box, self.what_if_button):
            height.addWidget(widget)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addLayout(head)
        layout.addWidget(source)
        layout.addWidget(visible)
        layout.addLayout(grid)
        layout.addStretch()
        layout.addWidget(self.result)
        layout.addLayout(height)
        layout.addWidget(self.field_bar)

    def _connect(self) -> None:
        sensitivity = self._sensitivity
        for index in range(ROWS):
            self.adds[index].clicked.connect(lambda _=False, i=index: self.add_mode(i))
            self.raises[index].clicked.connect(lambda _=False, i=index: self._emphasize(i, "raise"))
            self.lowers[index].clicked.connect(lambda _=False, i=index: self._emphasize(i, "lower"))
            self.isolates[index].clicked.connect(
                lambda _=False, i=index: self._emphasize(i, "isolate")
            )
        self._layer.peakClicked.connect(self.add_mode)
        self._layer.intervalsChanged.connect(lambda _intervals: self._forget_result())
        self._measured.changed.connect(self.refresh)
        self._dispatcher.pickAnswered.connect(self._find_values)
        self._dispatcher.visibilityAnswered.connect(self._find_values)
        self._visible.linkActivated.connect(lambda _link: self._list_region())
        trials = self._dispatcher.trials
        trials.whatIfAnswered.connect(self._take_what_if)
        trials.dropped.connect(self.result.setText)
        self._dispatcher.regionAnswered.connect(self.refresh)
        self._state.inputsChanged.connect(self._forget_result)
        sensitivity.regionsChanged.connect(self._forget_result)
        self.back.clicked.connect(self.leave_values)
        self.what_if_button.turnedOn.connect(self.start_what_if)
        self.what_if_button.turnedOff.connect(self.end_what_if)
        self.height_box.valueChanged.connect(lambda height: sensitivity.choose(height=height))
        self.field_bar.addRequested.connect(self.add_mode_over_band)
        sensitivity.choicesChanged.connect(lambda _choices: self._forget_result())
        sensitivity.placeChanged.connect(lambda _place: self._find_values())
        sensitivity.bandChanged.connect(lambda _band: self._enable_what_if())

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
        if index >= len(self._found):
            return
        functions = {"raise": raise_value, "lower": lower_value, "isolate": isolate_value}
        tf = self._state.transfer_function
        opacity = functions[how](tf.opacity, self._found[index].value, self._width())
        self._state.commit(replace(tf, opacity=opacity), f"{how} value")

    def _forget_result(self) -> None:
        self.result.clear()
        self.refresh()

    def _list_region(self) -> None:
        self._lists_region = True
        self._find_values()

    def _find_values(self) -> None:
        self._found = ()
        if self._lists_values and self._values is not None:
            self._found = contributions(self._values.value[0], self._state.scalar_range)
        self.refresh()

    def _take_what_if(self, answer: WhatIfAnswer) -> None:
        self._what_if[SOURCE_NAMES[answer.source]] = answer
        texts = [f"A mode at {self._text(self._tried)}, on the region:"]
        for name, one in self._what_if.items():
            predicted = one.what_if.predicted
            said = "" if predicted is None else f", predicted {predicted:.3f}"
            texts.append(f"{name}: RMSE {one.what_if.rmse:.3f}{said}")
        self.result.setText("\n".join(texts))
        if self.what_if_button.isChecked():
            self.whatIfShown.emit(answer)

    def _text(self, value: float) -> str:
        return value_text(value, self._state.scalar_range)

    def _interval_text(self, index: int) -> str:
        interval = self._layer.intervals[index]
        predicted = self._effect(interval.predicted(self._sensitivity.choices.height))
        measured = self._measured.change(interval)
        effect = f"≈ {predicted}" if measured is None else self._effect(measured)
        self.rows[index].setToolTip(
            f"{self._text(interval.low)} to {self._text(interval.high)}: a mode of this opacity "
            "changes the region's pixels by so much (1 is from black to white), as rendered. "
            f"The curve, which is of faint edits, promises: {predicted}."
        )
        return f"{index + 1}   {self._text(interval.value)}   {effect}"

    def _effect(self, change: float) -> str:
        if self._sensitivity.choices.measure == "change":
            return f"changes {change:.2g}"
        return f"{'brighter' if change > 0 else 'darker'} {change:+.2g}"

    def _found_text(self, index: int) -> str:
        found = self._found[index]
        self.rows[index].setToolTip("Share of what is visible there")
        return f"{self._text(found.value)}   {100 * found.share:.0f} %"


def _tip(text: str, lacking: str) -> str:
    """Return a tooltip; where something is lacking, it comes first."""
    return f"{lacking}.\n{text}" if lacking else text
