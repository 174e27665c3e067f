"""Measures what images while something moves cost in the present scene, and how wrong they are."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QObject, Signal

from app.engines.client import EngineClient
from app.engines.messages import ImageRequest, Result, TradeRequest
from app.engines.states import EngineState
from app.state.dispatcher import Dispatcher
from app.state.exactness import Exactness
from app.state.image_errors import distance
from app.state.pace import SCALES
from app.state.viewer_state import ViewerState

REPEATED_BELOW = 0.15
"""Seconds of an image below which it is drawn a second time; the faster time counts."""


@dataclass(frozen=True)
class Traded:
    """An image of fewer pixels than at rest: its time, and its distance from the one at rest.

    Attributes
    ----------
    scale : float
        Part of the width that is drawn.
    seconds : float
    error : float
        Root mean square of the colours' differences, 0 to 1.
    """

    scale: float
    seconds: float
    error: float


class TradeWork(QObject):
    """Has the present scene drawn as while something moves, at each number of pixels.

    Only while somebody looks, and while nothing moves and the image at rest is there, against
    which the others are measured. A change ends it, and what was measured is forgotten.

    Parameters
    ----------
    state : ViewerState
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
        self._state, self._reference, self._stand_in = state, reference, stand_in
        self._dispatcher = dispatcher
        self._is_watched = False
        self._truth: Result | None = None
        self._asked: TradeRequest | None = None
        self._first: Result | None = None
        self._sequence = 0
        state.inputsChanged.connect(self._forget)
        reference.stateChanged.connect(self._follow)
        for client in (reference, stand_in):
            client.resultReady.connect(self._take)

    @property
    def is_measuring(self) -> bool:
        """Whether more is about to be found."""
        return self._asked is not None

    @property
    def is_complete(self) -> bool:
        """Whether all is found."""
        return len(self.found) == len(SCALES)

    @property
    def _next_scale(self) -> float:
        return sorted(SCALES)[len(self.found)]

    def watch(self, is_watched: bool) -> None:
        """Measure from now on, or no more."""
        self._is_watched = is_watched
        if is_watched:
            self._go_on()
        else:
            self._call_off()

    def at(self, step: Exactness) -> Traded | None:
        """Return the image that a step leads to: the finest that it has time for, or the fastest.

        None as long as not all is measured.
        """
        if not self.is_complete:
            return None
        fast = [each for each in self.found if each.seconds <= step.live_seconds]
        return max(fast, key=lambda each: each.scale) if fast else self.found[0]

    def _follow(self, state: EngineState) -> None:
        if state is EngineState.SETTLED:
            self._go_on()
        elif state is EngineState.LOADING:
            self._truth = None
            self._forget()

    def _forget(self) -> None:
        self._call_off()
        if self.found:
            self.found = ()
            self.changed.emit()

    def _call_off(self) -> None:
        if self._asked is not None:
            self._asked = None
            for client in (self._reference, self._stand_in):
                client.abandon(TradeRequest)
            self.changed.emit()

    def _go_on(self) -> None:
        """Ask for the next image, if it is wanted and can be measured."""
        truth, is_due = self._truth, self._is_watched and not self.is_complete
        if not is_due or self._asked is not None or truth is None or self._state.live:
            return
        is_at_rest = self._reference.state is EngineState.SETTLED
        if is_at_rest and truth.request.inputs == self._state.inputs:
            self._first = None
            self._ask()

    def _ask(self) -> None:
        client, quality = self._dispatcher.live_at(self._next_scale)
        self._sequence += 1
        self._asked = TradeRequest(self._sequence, self._state.inputs, quality)
        client.submit(self._asked)
        self.changed.emit()

    def _take(self, result: Result) -> None:
        request = result.request
        if isinstance(request, ImageRequest):
            if not request.quality.live:
                self._truth = result
        elif request is self._asked:
            self._measure(result)

    def _measure(self, result: Result) -> None:
        self._asked = None
        if result.value is None or self._truth is None or self._truth.value is None:
            self.changed.emit()
            return
        first, self._first = self._first, None
        if first is None and result.seconds < REPEATED_BELOW:
            self._first = result
            self._ask()
            return
        seconds = result.seconds if first is None else min(result.seconds, first.seconds)
        found = Traded(self._next_scale, seconds, distance(result.value, self._truth.value))
        self.found = (*self.found, found)
        self._go_on()
        self.changed.emit()
