"""Measurement of images while something moves, in the present scene: their times and errors."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import QObject, Signal

from app.engines.client import Channel, EngineClient, EngineState
from app.engines.exactness import Exactness
from app.engines.messages import Result
from app.engines.pace import SCALES
from app.engines.requests import ImageRequest, TradeRequest
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
    """Has the present scene measured as while something moves, at each number of pixels.

    Only while somebody looks, and once the image at rest is there. A change of the scene ends it.

    Attributes
    ----------
    found : tuple of Traded
        The fewest pixels first; empty until all are measured.
    begun : int
        Number of the image that is being measured; 0 while none is.
    """

    changed = Signal()

    def __init__(self, state: ViewerState, reference: EngineClient, parent: QObject) -> None:
        super().__init__(parent)
        self.found: tuple[Traded, ...] = ()
        self.begun = 0
        self._state, self._reference = state, reference
        self._is_watched = False
        self._channel = Channel(reference, "measured", self)
        self._channel.answered.connect(self._take)
        self._channel.progressed.connect(self._note)
        state.inputsChanged.connect(self._forget)
        reference.stateChanged.connect(self._follow)

    def watch(self, is_watched: bool) -> None:
        """Say whether somebody looks."""
        self._is_watched = is_watched
        if is_watched:
            self._measure()
        else:
            self._end()

    def at(self, stop: Exactness) -> Traded | None:
        """Return the image that a stop leads to: the finest that it has time for, or the fastest.

        None as long as nothing is measured.
        """
        fast = [each for each in self.found if each.seconds <= stop.live_seconds]
        return fast[-1] if fast else next(iter(self.found), None)

    def _follow(self, state: EngineState) -> None:
        if state is EngineState.SETTLED:
            self._measure()
        elif state is EngineState.LOADING:
            self._forget()

    def _forget(self) -> None:
        self.found = ()
        self._end()

    def _end(self) -> None:
        self._channel.cancel()
        self._note(-1.0)

    def _measure(self) -> None:
        newest = self._reference.images.newest
        is_wanted = self._is_watched and not (self.found or self._channel.is_pending)
        is_at_rest = self._reference.state is EngineState.SETTLED
        if is_wanted and is_at_rest and isinstance(newest, ImageRequest):
            self._channel.ask(TradeRequest(newest.inputs, newest.quality))
            self._note(0.0)

    def _note(self, part: float) -> None:
        self.begun = 1 + round(part * len(SCALES)) if part >= 0 else 0
        self.changed.emit()

    def _take(self, result: Result) -> None:
        if result.value is not None:
            rows = zip(sorted(SCALES), result.value.tolist(), strict=True)
            self.found = tuple(Traded(scale, *measured) for scale, measured in rows)
        self._note(-1.0)
