"""The offer of a logarithmic scale for a volume that needs one."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject

from app.controls import Action
from app.state.opened_volume import OpenedVolume
from app.state.viewer_state import ViewerState
from app.state.workspace import Workspace
from app.window.notices import Notices
from model.scene.value_scale import LOGARITHM_OFFER, suits_logarithm

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
                Action("Logarithmic scale", partial(self._workspace.ranging.show_on_scale, "log")),
                key=OFFER,
            )

    def _withdraw(self, opened: OpenedVolume) -> None:
        if opened.volume.scale == "log":
            self._notice.clear(OFFER)
