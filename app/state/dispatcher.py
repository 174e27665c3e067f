"""Dispatch of the viewer's state as image requests to both engines."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtCore import QObject

from app.engines.client import EngineClient
from app.engines.messages import ImageRequest, Quality
from app.state.viewer_state import ViewerState

NO_MODEL_SIZE = 512
"""Size of the reference image without a generator, in pixels."""

LIVE_COARSENESS = 4.0
"""Factor of the sample distance in live images."""

LIVE_MAX_SIZE = 256
"""Largest size of live images in pixels; larger ones are rendered at half their size."""


def quality_of(size: int, live: bool) -> Quality:
    """Return the quality for a size in pixels; live images are coarser and may be smaller."""
    if not live:
        return Quality(size)
    return Quality(size // 2 if size > LIVE_MAX_SIZE else size, LIVE_COARSENESS, live=True)


class Dispatcher(QObject):
    """Sends an image request to all engines at every change of the viewer's state.

    Attributes
    ----------
    size : int
        Size of the reference image, in pixels.
    hidden : EngineClient or None
        Client whose image nobody sees: it is asked for none.
    """

    def __init__(
        self, state: ViewerState, clients: Iterable[EngineClient], parent: QObject
    ) -> None:
        super().__init__(parent)
        self.size = NO_MODEL_SIZE
        self.hidden: EngineClient | None = None
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
        """Request the final images of the present state."""
        self._submit(live=False)

    def _send_live(self) -> None:
        # A change outside a drag is immediately followed by its final request.
        if self._state.live:
            self._submit(live=True)

    def _submit(self, live: bool) -> None:
        self._sequence += 1
        request = ImageRequest(self._sequence, self._state.inputs, quality_of(self.size, live))
        for client in self._clients:
            if client is not self.hidden:
                client.submit(request)
