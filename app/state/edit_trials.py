"""An edit that is rendered to see what it would do, without being made."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.channels import Channels
from app.engines.client import EngineClient
from app.engines.messages import Result
from app.engines.requests import BatchRequest
from app.state.brightness import Brightness
from app.state.engine_chooser import EngineChooser, EngineName
from app.state.sensitivity_answers import FieldAnswer, Source, WhatIfAnswer
from app.state.sensitivity_state import SensitivityState
from app.state.viewer_state import ViewerState
from model.rendering.brightness import brighten
from model.scene.region import Outline
from model.scene.tf_perturbation import edit_over
from model.sensitivity.display import SMALL_EDIT, shown_field
from model.sensitivity.what_if import compare, edited

Images = NDArray[np.float32]


class EditTrials(QObject):
    """Has an edit rendered by the engines that answer questions about sensitivities.

    Parameters
    ----------
    clients : dict
        Clients of the engines by name.
    field_of : callable
        Returns the newest field of a source, from which changes are predicted.
    brightness : Brightness
        Changes are measured as images are shown.
    """

    whatIfAnswered = Signal(object)
    """Emitted with a :class:`WhatIfAnswer`."""
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
        self._asked_edit: tuple[Outline, NDArray[np.float32]] | None = None
        """The region, and the edit that was asked about last."""
        self._channels = Channels(clients, "what if", self._take, self)

    def forget(self) -> None:
        """Ignore the results of all trials so far."""
        self._channels.cancel()

    def ask_what_if(self, edit: NDArray[np.float32]) -> bool:
        """Have an edit rendered by all engines; return False if there is none."""
        self._asked_edit = self._asked.outline, edit
        after = edited(self._state.inputs, edit, self._asked.choices.height)
        names = self._chooser.available
        for name in names:
            quality = self._chooser.quality(name, "images")
            self._channels[name].ask(BatchRequest(self._state.inputs, quality, (after,)))
        return bool(names)

    def _take(self, name: EngineName, result: Result) -> None:
        if self._channels[name].is_pending:
            return
        if result.value is None or result.request.inputs != self._state.inputs:
            self.dropped.emit(result.error or "")
        else:
            source = (self._chooser.exact_source or "exact") if name == "exact" else "learned"
            self._show(source, result.value)

    def _show(self, source: Source, images: Images) -> None:
        assert self._asked_edit is not None
        outline, edit = self._asked_edit
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
