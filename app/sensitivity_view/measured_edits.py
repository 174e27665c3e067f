"""Measurement of the edits that have a flag, which are rendered at rest."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer, Signal

from app.sensitivity_view.response_layer import ResponseLayer
from app.state.edit_trials import IntervalTrial
from app.state.sensitivity_dispatcher import SensitivityDispatcher
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.sensitivity.intervals import Interval
from model.sensitivity.what_if import WhatIf

REST_MS = 250
"""Pause after the last answer until its edits are rendered."""


class MeasuredEdits(QObject):
    """Has the edits rendered: what they change in truth.

    A derivative says what a faint edit does. Where an image saturates, as before an opaque
    surface, it predicts many times too much.

    Parameters
    ----------
    layer : ResponseLayer
        Knows the intervals.
    """

    changed = Signal()
    """Emitted when changes were measured."""

    def __init__(
        self,
        state: ViewerState,
        sensitivity: SensitivityState,
        dispatcher: SensitivityDispatcher,
        layer: ResponseLayer,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._sensitivity = sensitivity
        self._dispatcher = dispatcher
        self._layer = layer
        self._asked: IntervalTrial | None = None
        self._measured: IntervalTrial | None = None
        self._found: dict[Interval, WhatIf] = {}
        self._rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._rest.timeout.connect(self._ask)
        for signal in (
            state.inputsChanged,
            sensitivity.regionsChanged,
            dispatcher.answers.regionAnswered,
            layer.intervalsChanged,
            sensitivity.choicesChanged,
            dispatcher.trials.outdated,
        ):
            signal.connect(self._follow)
        dispatcher.trials.intervalsMeasured.connect(self._take)

    def found(self, interval: Interval) -> WhatIf | None:
        """Return what a mode in an interval does; None until it is measured."""
        return self._found.get(interval) if self._measured == self._trial else None

    @property
    def _trial(self) -> IntervalTrial:
        return self._dispatcher.trials.trial_of(self._layer.intervals)

    def _follow(self, *_change: object) -> None:
        if self._trial not in (self._asked, self._measured):
            self._asked = None
            self._dispatcher.trials.stop_measuring()
            self._rest.start()

    def _ask(self) -> None:
        dispatcher, asked = self._dispatcher, self._sensitivity
        is_fresh = dispatcher.answers.is_fresh(dispatcher.answers.region)
        moves = self._state.live or asked.dragging
        if self._layer.intervals and asked.choices.shown and is_fresh and not moves:
            self._asked = self._trial
            dispatcher.trials.measure(self._layer.intervals)

    def _take(self, trial: IntervalTrial, found: list[WhatIf]) -> None:
        if trial == self._trial:
            self._measured = trial
            self._found = dict(zip(trial.intervals, found, strict=True))
            self.changed.emit()
