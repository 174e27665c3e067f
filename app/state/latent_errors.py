"""The model's error over the map: its pictures of some samples against the ray caster's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.channels import Channels
from app.engines.client import EngineClient
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import BatchRequest
from app.state.engine_chooser import EngineName
from app.state.latent_drawer import look_of
from app.state.latent_session import LatentSession
from app.state.latent_state import LatentState
from app.state.viewer_state import ViewerState

MEASURED = 96
"""Samples whose pictures are compared; the others take their nearest neighbours' errors."""

AT_ONCE = 8
NEIGHBOURS = 4

Images = NDArray[np.float32]


class LatentErrors(QObject):
    """Compares both engines while the map is coloured by the model's error.

    Parameters
    ----------
    state : ViewerState
    latent : LatentState
    session : LatentSession
    clients : dict
        Clients of the engines by name.

    Attributes
    ----------
    errors : ndarray of float32, shape (n,), or None
        RMSE (0..1) at every sample of the map, of what is measured near it so far.
    """

    changed = Signal()

    def __init__(
        self,
        state: ViewerState,
        latent: LatentState,
        session: LatentSession,
        clients: dict[EngineName, EngineClient],
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.errors: NDArray[np.float32] | None = None
        self._state = state
        self._latent = latent
        self._session = session
        self._size: int | None = None
        self._left: list[int] = []
        self._found: dict[int, float] = {}
        self._asked: tuple[int, ...] = ()
        self._images: dict[EngineName, Images] = {}
        latent.choicesChanged.connect(lambda _choices: self._start_if_needed())
        session.mapClosed.connect(self.restart)
        session.mapOpened.connect(self.restart)
        state.inputsChangeFinished.connect(self._inputs_changed)
        self._inputs = state.inputs
        self._channels = Channels(clients, "errors of the map", self._take, self)

    def set_learned(self, size: int | None) -> None:
        """Set the image size of a generator that fits the volume; None without one."""
        if size != self._size:
            self._size = size
            self.restart()

    def restart(self) -> None:
        """Measure anew, in the present view, light and colours."""
        self.errors = None
        self._left, self._found, self._asked, self._images = [], {}, (), {}
        self._channels.cancel()
        self.changed.emit()
        self._start_if_needed()

    def _inputs_changed(self) -> None:
        inputs = self._state.inputs
        before, self._inputs = self._inputs, inputs
        if look_of(before) != look_of(inputs):
            self.restart()

    def _start_if_needed(self) -> None:
        map_ = self._session.map
        if not self._is_wanted or map_ is None or self._size is None or self._asked:
            return
        if not self._left and not self._found:
            count = min(MEASURED, len(map_.codes))
            rng = np.random.default_rng(0)
            self._left = rng.choice(len(map_.codes), count, replace=False).tolist()
        self._ask()

    @property
    def _is_wanted(self) -> bool:
        choices = self._latent.choices
        return choices.shown and choices.coloring == "error"

    def _ask(self) -> None:
        map_, space = self._session.map, self._session.space
        if not self._left or map_ is None or space is None or self._size is None:
            return
        if not self._is_wanted:
            # What is left is measured when it is wanted again.
            return
        self._asked = tuple(self._left[:AT_ONCE])
        self._images = {}
        inputs = [
            replace(self._state.inputs, opacity_tf=tf)
            for tf in space.tfs_of(map_.codes[[*self._asked]])
        ]
        for channel in self._channels.values():
            channel.ask(BatchRequest(inputs[0], Quality(self._size), tuple(inputs[1:])))

    def _take(self, name: EngineName, result: Result) -> None:
        if self._channels[name].is_pending:
            return
        if result.value is None or not self._asked:
            self._left, self._asked = [], ()
            return
        self._images[name] = result.value
        if len(self._images) < len(self._channels):
            return
        one, other = (images[..., :3] for images in self._images.values())
        errors = np.sqrt(np.square(one - other).mean(axis=(1, 2, 3)))
        self._found.update(zip(self._asked, errors.tolist(), strict=True))
        self._left = self._left[len(self._asked) :]
        self._asked = ()
        self._spread()
        self.changed.emit()
        self._ask()

    def _spread(self) -> None:
        """Give every sample the mean error of its nearest measured ones."""
        map_ = self._session.map
        assert map_ is not None
        known = np.array(list(self._found))
        errors = np.array(list(self._found.values()))
        count = min(NEIGHBOURS, len(known))
        nearest = map_.nearest_of(known, count)
        self.errors = errors[nearest].mean(axis=1).astype(np.float32)
