"""Sends what the viewer's state shows to both engines, always together."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtCore import QObject

from app.engines.client import EngineClient
from app.engines.messages import ImageRequest, Quality
from app.state.viewer_state import ViewerState

NO_MODEL_SIZE = 512
"""Size of the reference image while no generator sets one, pixels."""

LIVE_COARSENESS = 4.0
"""How much farther apart a live image's samples lie along the rays."""

LIVE_MAX_SIZE = 256
"""Largest live image, pixels; a larger one is rendered at half its size."""


def quality_of(size: int, live: bool) -> Quality:
    """The quality of an image of a size in pixels: coarser and, where large, smaller while live."""
    if not live:
        return Quality(size)
    return Quality(size // 2 if size > LIVE_MAX_SIZE else size, LIVE_COARSENESS, live=True)


class Dispatcher(QObject):
    """Turns every change of the viewer's state into one request for all engines.

    Attributes
    ----------
    size : int
        Of the reference image, in pixels.
    """

    def __init__(
        self, state: ViewerState, clients: Iterable[EngineClient], parent: QObject
    ) -> None:
        super().__init__(parent)
        self.size = NO_MODEL_SIZE
        self._state = state
        self._clients = tuple(clients)
        self._sequence = 0
        for changed, finished in (
            (state.viewChanged, state.viewChangeFinished),
            (state.transferFunctionChanged, state.transferFunctionChangeFinished),
            (state.lightChanged, state.lightChangeFinished),
        ):
            changed.connect(self._send_live)
            finished.connect(self.send)

    def send(self) -> None:
        """Request the final images of what is shown now."""
        self._submit(live=False)

    def _send_live(self) -> None:
        # A change outside a drag is followed at once by its final request.
        if self._state.live:
            self._submit(live=True)

    def _submit(self, live: bool) -> None:
        self._sequence += 1
        request = ImageRequest(self._sequence, self._state.inputs, quality_of(self.size, live))
        for client in self._clients:
            client.submit(request)
