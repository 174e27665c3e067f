"""Tells when an image is not up to date, and the newer one takes its time."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.client import EngineClient, EngineState
from app.engines.requests import Request
from app.state.at_work import PATIENCE_MS
from model.scene.inputs import SceneInputs


class Lateness(QObject):
    """Follows what an engine was asked for, and which of it is shown.

    Parameters
    ----------
    client : EngineClient
    parent : QObject
    """

    changed = Signal(bool)
    """Emitted with whether the image is not the wanted one, and has not been for a while."""

    def __init__(self, client: EngineClient, parent: QObject) -> None:
        super().__init__(parent)
        self._wanted: SceneInputs | None = None
        self._shown: SceneInputs | None = None
        self._patience = QTimer(self, singleShot=True, interval=PATIENCE_MS)
        self._patience.timeout.connect(lambda: self.changed.emit(True))
        client.images.asked.connect(self._wait)
        client.stateChanged.connect(self._follow)

    def note(self, inputs: SceneInputs) -> None:
        """Note that an image is shown, of these inputs."""
        self._shown = inputs
        self.changed.emit(False)
        if self._wanted in (None, inputs):
            self._patience.stop()
        else:
            self._patience.start()

    def _wait(self, request: Request) -> None:
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
            self.changed.emit(False)
