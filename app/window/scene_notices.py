"""Notices about how the open volume is shown: what cannot be seen, and what would show it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from PySide6.QtCore import QObject

from app.controls import Action
from app.engines.messages import Result
from app.image_view.engine_pane import EnginePane
from app.state.opened_volume import OpenedVolume
from app.state.reference_work import ReferenceChoices, ReferenceWork
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.window.notices import Notices
from model.scene.narrow_part import NarrowPart, narrow_part
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import LOGARITHM_OFFER, suits_logarithm
from model.scene.visibility_hint import nothing_visible, why_nothing

NARROW = "narrow part of the TF"
"""Key of the notice."""


class NarrowNotice(QObject):
    """Watches the TF; what was dismissed is said again only of another part or range.

    Parameters
    ----------
    show_range : callable
        Shows the volume over a range, as an undo step.
    """

    def __init__(
        self,
        state: ViewerState,
        notice: Notices,
        show_range: Callable[[Range], object],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._notice = notice
        self._show_range = show_range
        self._noted: NarrowPart | None = None
        state.volumeStarting.connect(self._forget)
        state.tf_input.changeFinished.connect(self._judge)

    def _forget(self) -> None:
        self._noted = None

    def _judge(self, transfer_function: TransferFunction) -> None:
        found = narrow_part(transfer_function.opacity, transfer_function.color)
        if found == self._noted:
            return
        self._noted = found
        if found is None:
            self._notice.clear(NARROW)
            return
        remedy = found.remedy
        action = Action(f"Show {found.remedy_text}", lambda: self._show_range(remedy))
        self._notice.tell(found.sentence, action, key=NARROW)


KEY = "light"


class LightNotice(QObject):
    """Follows the light that the window chooses by itself."""

    def __init__(self, work: ReferenceWork, notices: Notices) -> None:
        super().__init__(notices)
        self._work = work
        self._notices = notices
        work.lightWentOut.connect(self._tell)
        work.choicesChanged.connect(self._follow)
        work.volumeStarted.connect(partial(notices.clear, KEY))

    def _tell(self, seconds: float) -> None:
        self._notices.tell(
            f"Drawn without light: with it, an image takes {seconds:.1f} s here.",
            Action("Light it", partial(self._work.choose, lighting="direct")),
            key=KEY,
        )

    def _follow(self, choices: ReferenceChoices) -> None:
        if choices.lighting != "auto":
            self._notices.clear(KEY)


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


OFFER = "logarithmic scale"
"""Key of the notice."""


class LogarithmOffer(QObject):
    """Offers the logarithm once such a volume is open, unless its TF was edited before."""

    def __init__(
        self, state: ViewerState, workspace: Workspace, notice: Notices, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._state = state
        self._workspace = workspace
        self._notice = notice
        workspace.volumeStarted.connect(self._offer)
        workspace.scaleChanged.connect(self._withdraw)

    def _offer(self) -> None:
        opened = self._workspace.opened
        if opened is None or opened.volume.scale == "log":
            return
        is_new = self._state.transfer_function == self._state.default_transfer_function
        if is_new and suits_logarithm(opened.volume.distribution):
            self._notice.tell(
                f"{opened.volume.name}: {LOGARITHM_OFFER}.",
                Action("Logarithmic scale", partial(self._workspace.opening.show_on_scale, "log")),
                key=OFFER,
            )

    def _withdraw(self, opened: OpenedVolume) -> None:
        if opened.volume.scale == "log":
            self._notice.clear(OFFER)
