"""Sends what the state shows to both engines, always together."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtCore import QObject

from app.engines.messages import RenderRequest
from app.image_view.engine_pane import EnginePane
from app.state.viewer_state import ViewerState

NO_MODEL_SIZE = 512
"""Size of the reference image while no generator sets one, pixels."""


class Dispatcher(QObject):
    """Turns every change of the state into one request for all panes.

    Attributes
    ----------
    size : int
        Of the reference image, in pixels.
    """

    def __init__(self, state: ViewerState, panes: Iterable[EnginePane], parent: QObject) -> None:
        super().__init__(parent)
        self.size = NO_MODEL_SIZE
        self._state = state
        self._panes = tuple(panes)
        self._sequence = 0
        state.viewChanged.connect(self._send_live)
        state.viewChangeFinished.connect(self.send)
        state.transferFunctionChanged.connect(self._send_live)
        state.transferFunctionChangeFinished.connect(self.send)

    def send(self) -> None:
        """Request the final images of what is shown now."""
        self._submit(live=False)

    def _send_live(self) -> None:
        # A change outside a drag is followed at once by its final request.
        if self._state.live:
            self._submit(live=True)

    def _submit(self, live: bool) -> None:
        self._sequence += 1
        request = RenderRequest(
            self._sequence,
            self._state.inputs,
            self.size,
            live,
        )
        for pane in self._panes:
            pane.submit(request)
