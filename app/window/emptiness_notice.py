"""Says over the images that one shows nothing, why, and what can be done."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtCore import QObject

from app.controls import Action
from app.engines.messages import Result
from app.image_view.engine_pane import EnginePane
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.window.notices import Notices
from model.scene.visibility_hint import nothing_visible, why_nothing


class EmptinessNotice(QObject):
    """Watches the final images of a pane.

    Parameters
    ----------
    workspace : Workspace
        Has the histogram of the volume.
    """

    def __init__(
        self, pane: EnginePane, state: ViewerState, workspace: Workspace, notices: Notices
    ) -> None:
        super().__init__(pane)
        self._state = state
        self._workspace = workspace
        self._notices = notices
        self._key = f"emptiness of the {pane.engine} image"
        pane.client.images.answered.connect(self._judge)
        pane.client.stateChanged.connect(self._follow_state)
        self._pane = pane

    def _follow_state(self, _state: Any) -> None:
        if self._pane.canvas.image is None or self._pane.canvas.message:
            self._notices.clear(self._key)

    def _judge(self, result: Result) -> None:
        request, opened = result.request, self._workspace.opened
        if result.value is None or opened is None:
            return
        if not nothing_visible(result.value):
            self._notices.clear(self._key)
            return
        if request.quality.live or request.inputs != self._state.inputs:
            return
        height, width = np.shape(result.value)[:2]
        found = why_nothing(
            request.inputs,
            opened.volume.data_range,
            opened.counts,
            opened.edges,
            width / height,
        )
        state = self._state
        actions = {
            "tf": Action("Default TF", state.reset_transfer_function),
            "view": Action("Reset view", state.reset_view),
            "crop": Action("Whole volume", lambda: state.crop_input.set(None)),
        }
        self._notices.tell(found.text, actions[found.cause], key=self._key)
