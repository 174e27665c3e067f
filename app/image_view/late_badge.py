"""A badge over an image that is not up to date, while the newer one takes its time."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer

from app.engines.client import EngineClient
from app.engines.messages import ImageRequest
from app.engines.states import EngineState
from app.image_view.image_canvas import ImageCanvas
from model.scene.inputs import SceneInputs

LATE_MS = 500
"""Time without an image after which the user is told that one is being drawn."""

DRAWING = "drawing …"


class LateBadge(QObject):
    """Says over an image that it is not the wanted one yet.

    Parameters
    ----------
    client : EngineClient
    canvas : ImageCanvas
        Shows the engine's images.
    """

    def __init__(self, client: EngineClient, canvas: ImageCanvas) -> None:
        super().__init__(canvas)
        self._canvas = canvas
        self._wanted: SceneInputs | None = None
        self._shown: SceneInputs | None = None
        self._patience = QTimer(self, singleShot=True, interval=LATE_MS)
        self._patience.timeout.connect(lambda: canvas.set_badge(DRAWING))
        client.imageRequested.connect(self._wait)
        client.stateChanged.connect(self._follow)

    def note(self, inputs: SceneInputs) -> None:
        """Note that an image is shown, of these inputs."""
        self._shown = inputs
        self._canvas.set_badge("")
        if self._wanted in (None, inputs):
            self._patience.stop()
        else:
            self._patience.start()

    def _wait(self, request: ImageRequest) -> None:
        self._wanted = request.inputs
        if self._wanted != self._shown and not self._patience.isActive():
            self._patience.start()

    def _follow(self, state: EngineState) -> None:
        if state is EngineState.LOADING:
            # Another light, perhaps: whatever is shown is not of it.
            self._shown = None
        elif state is not EngineState.WORKING:
            self._wanted = None
            self._patience.stop()
            self._canvas.set_badge("")
