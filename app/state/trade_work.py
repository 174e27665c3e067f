"""Measures what images while something moves cost in the present scene, and how wrong they are."""

from __future__ import annotations

from dataclasses import dataclass, replace

from PySide6.QtCore import QObject, Signal

from app.engines.channels import Channels
from app.engines.client import EngineClient
from app.engines.messages import Result
from app.engines.requests import ImageRequest
from app.engines.states import EngineState
from app.state.dispatcher import Dispatcher
from app.state.exactness import Exactness
from app.state.image_errors import distance
from app.state.pace import SCALES
from app.state.viewer_state import ViewerState


@dataclass(frozen=True)
class Traded:
    """An image of fewer pixels than at rest: its time, and its distance from the one at rest.

    Attributes
    ----------
    scale : float
        Part of the width that is drawn.
    error : float
        Root mean square of the colours' differences, 0 to 1.
    """

    scale: float
    seconds: float
    error: float


class TradeWork(QObject):
    """Has the present scene drawn as while something moves, at each number of pixels.

    Only while somebody looks, and once the image at rest is there, against which the others are
    measured. A change of the scene ends it.

    Parameters
    ----------
    reference, stand_in : EngineClient
        One of them draws while something moves.
    dispatcher : Dispatcher
        Knows which, and at which quality.

    Attributes
    ----------
    found : tuple of Traded
        The fewest pixels first.
    """

    changed = Signal()

    def __init__(
        self,
        state: ViewerState,
        reference: EngineClient,
        stand_in: EngineClient,
        dispatcher: Dispatcher,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.found: tuple[Traded, ...] = ()
        self._state, self._reference, self._dispatcher = state, reference, dispatcher
        self._is_watched = False
        self._truth: Result | None = None
        clients = {client: client for client in (reference, stand_in)}
        self._channels = Channels(clients, "measured", self._measure, self)
        state.inputsChanged.connect(self._forget)
        reference.stateChanged.connect(self._follow)
        reference.images.answered.connect(self._take)

    @property
    def is_measuring(self) -> bool:
        """Whether more is about to be found."""
        return self._channels.is_pending

    @property
    def is_complete(self) -> bool:
        """Whether all is found."""
        return len(self.found) == len(SCALES)

    def watch(self, is_watched: bool) -> None:
        """Say whether somebody looks."""
        self._is_watched = is_watched
        if is_watched:
            self._go_on()
        else:
            self._channels.cancel()

    def at(self, stop: Exactness) -> Traded | None:
        """Return the image that a stop leads to: the finest that it has time for, or the fastest.

        None as long as not all is measured.
        """
        if not self.is_complete:
            return None
        fast = [each for each in self.found if each.seconds <= stop.live_seconds]
        return fast[-1] if fast else self.found[0]

    def _follow(self, state: EngineState) -> None:
        if state is EngineState.SETTLED:
            self._go_on()
        elif state is EngineState.LOADING:
            self._truth = None
            self._forget()

    def _forget(self) -> None:
        self._channels.cancel()
        self.found = ()
        self.changed.emit()

    def _take(self, result: Result) -> None:
        if not result.request.quality.live:
            self._truth = result

    def _go_on(self) -> None:
        """Ask for the next image, if it is wanted and can be measured."""
        truth, is_at_rest = self._truth, self._reference.state is EngineState.SETTLED
        is_wanted = self._is_watched and not (self.is_complete or self.is_measuring)
        if is_wanted and is_at_rest and truth and truth.request.inputs == self._state.inputs:
            client, quality = self._dispatcher.live_at(sorted(SCALES)[len(self.found)])
            # It is not live: it is given up for what is asked for meanwhile.
            quality = replace(quality, live=False)
            self._channels[client].ask(ImageRequest(self._state.inputs, quality, is_measured=True))
        self.changed.emit()

    def _measure(self, _client: EngineClient, result: Result) -> None:
        if result.value is not None and self._truth is not None and self._truth.value is not None:
            scale = sorted(SCALES)[len(self.found)]
            error = distance(result.value, self._truth.value)
            self.found = (*self.found, Traded(scale, result.seconds, error))
            self._go_on()
        else:
            self.changed.emit()
