"""Edits that are rendered to see what they would do, without being made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.channels import Channels
from app.engines.client import Channel, EngineClient
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import BatchRequest
from app.state.brightness import Brightness
from app.state.engine_chooser import EngineChooser, EngineName
from app.state.sensitivity_answers import FieldAnswer, Source, WhatIfAnswer
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.rendering.brightness import brighten
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.tf_perturbation import edit_around, edit_over
from model.sensitivity.display import SMALL_EDIT, shown_field
from model.sensitivity.intervals import Interval
from model.sensitivity.measure import Measure
from model.sensitivity.what_if import compare, edited

Images = NDArray[np.float32]


@dataclass(frozen=True)
class IntervalTrial:
    """A question about intervals; its answer is not read as one to another question."""

    inputs: SceneInputs
    intervals: tuple[Interval, ...]
    outline: Outline
    width: float
    height: float
    measure: Measure
    brightness: float


Show = Callable[[Source, Images], None]
"""Takes the images, and who drew them."""


class EditTrials(QObject):
    """Has edits rendered by the engines that answer questions about sensitivities.

    Two kinds of trials: what one edit would show, which somebody waits for, and how much each of
    several edits changes, which is measured at rest.

    Parameters
    ----------
    state : ViewerState
    asked : SensitivityState
    chooser : EngineChooser
    clients : dict
        Clients of the engines by name.
    field_of : callable
        Returns the newest field of a source, from which changes are predicted.
    brightness : Brightness
        Changes are measured as images are shown.
    """

    whatIfAnswered = Signal(object)
    """Emitted with a :class:`WhatIfAnswer`."""
    intervalsMeasured = Signal(object, object)
    """Emitted with an :class:`IntervalTrial`, and a list of what each of its modes does: WhatIf."""
    outdated = Signal()
    """Emitted when images are shown in another brightness, in which other edits show."""
    dropped = Signal(str)
    """Emitted with the reason, or nothing, when a trial has no result."""

    def __init__(
        self,
        state: ViewerState,
        asked: SensitivityState,
        chooser: EngineChooser,
        clients: dict[EngineName, EngineClient],
        field_of: Callable[[Source], FieldAnswer | None],
        brightness: Brightness,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._asked = asked
        self._chooser = chooser
        self._field_of = field_of
        self._brightness = brightness
        brightness.changed.connect(self.outdated)
        self._shown: dict[Channel, Show] = {}
        self._what_ifs = Channels(clients, "what if", self._take_what_if, self)
        self._measured = Channels(clients, "measured edits", self._take_measured, self)

    def forget(self) -> None:
        """Ignore the results of all trials so far."""
        self._what_ifs.cancel()
        self._measured.cancel()

    def ask_what_if(self, edit: NDArray[np.float32]) -> bool:
        """Have an edit rendered by all engines; return False if there is none."""
        outline = self._asked.outline
        after = edited(self._state.inputs, edit, self._asked.choices.height)
        names = self._chooser.available
        for name in names:
            quality = self._chooser.quality(name, "images")
            self._ask(
                self._what_ifs[name], quality, (after,), partial(self._show_what_if, outline, edit)
            )
        return bool(names)

    def measure(self, intervals: tuple[Interval, ...]) -> None:
        """Have a mode in each interval rendered by the engine that is asked first."""
        inputs, choices = self._state.inputs, self._asked.choices
        scalar_range = self._state.scalar_range
        edits = [edit_around(i.value, scalar_range, choices.width) for i in intervals]
        more = tuple(edited(inputs, edit, choices.height) for edit in edits)
        trial = self.trial_of(intervals)
        chooser = self._chooser
        for name in chooser.order("images", live=False)[:1]:
            quality = chooser.in_common(chooser.measuring_quality(name), chooser.available)
            self._ask(self._measured[name], quality, more, partial(self._show_intervals, trial))

    def stop_measuring(self) -> None:
        """Call off what is measured: it is about something else by now."""
        for channel in self._measured.values():
            if channel.is_pending:
                channel.cancel()

    def trial_of(self, intervals: tuple[Interval, ...]) -> IntervalTrial:
        """Return the trial of intervals by the present choices."""
        choices = self._asked.choices
        return IntervalTrial(
            self._state.inputs,
            intervals,
            self._asked.outline,
            choices.width,
            choices.height,
            choices.measure,
            self._brightness.value,
        )

    def _ask(
        self, channel: Channel, quality: Quality, more: tuple[SceneInputs, ...], show: Show
    ) -> None:
        self._shown[channel] = show
        channel.ask(BatchRequest(self._state.inputs, quality, more))

    def _take_what_if(self, name: EngineName, result: Result) -> None:
        self._take(name, self._what_ifs[name], result)

    def _take_measured(self, name: EngineName, result: Result) -> None:
        self._take(name, self._measured[name], result)

    def _take(self, name: EngineName, channel: Channel, result: Result) -> None:
        if channel.is_pending:
            return
        if result.value is None or result.request.inputs != self._state.inputs:
            self.dropped.emit(result.error or "")
        else:
            source = (self._chooser.exact_source or "exact") if name == "exact" else "learned"
            self._shown[channel](source, result.value)

    def _show_what_if(
        self, outline: Outline, edit: NDArray[np.float32], source: Source, images: Images
    ) -> None:
        field = self._field_of(source)
        predicted = None
        as_computed = self._brightness.value == 1
        if as_computed and field is not None and field.is_of(self._state.inputs):
            request = field.request
            its_edit = edit_over(request.values, self._state.scalar_range, request.width)
            if np.array_equal(its_edit, edit):
                shown = shown_field(field.value, edit, "change")
                inside = shown[outline.mask(shown.shape)]
                scale = self._asked.choices.height / SMALL_EDIT
                predicted = scale * float(np.sqrt(np.square(inside).mean()))
        colors = self._as_shown(images, source)
        what_if = compare(colors[0], colors[1], outline.mask(images.shape[1:3]), predicted)
        self.whatIfAnswered.emit(WhatIfAnswer(what_if, source))

    def _as_shown(self, images: Images, source: Source) -> Images:
        """Return colours as they are shown.

        Where bright parts fade and dark ones shine, the brightness decides which of them count.
        """
        colors = np.clip(images[..., :3], 0, 1)
        brighten(colors, self._brightness.of("learned" if source == "learned" else "exact"))
        return colors

    def _show_intervals(self, trial: IntervalTrial, source: Source, images: Images) -> None:
        mask = trial.outline.mask(images.shape[1:3])
        colors = self._as_shown(images, source)
        found = [compare(colors[0], after, mask) for after in colors[1:]]
        self.intervalsMeasured.emit(trial, found)
