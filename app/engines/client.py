"""The window's side of an engine: its worker, its state and its newest results."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from app.engines.engine import Engine
from app.engines.messages import (
    EngineReady,
    ImageRequest,
    Request,
    Result,
    StandInRequest,
    TradeRequest,
)
from app.engines.states import SETTLED_STATES, TRANSITIONS, EngineState
from app.engines.worker import EngineWorker


class EngineClient(QObject):
    """Runs one engine at a time in a worker thread and tracks its state.

    The state depends on image requests only; other kinds of requests do not change it.

    Parameters
    ----------
    name : str
        Name of the worker's thread.

    Attributes
    ----------
    state : EngineState
    text : str
        Explanation of the state: what the engine waits for, why it draws nothing, or
        the error. Empty while images are drawn.
    description : str
        Device and backend of the engine, for display; may be empty.
    remark : str
        One sentence on why this engine draws, and no other; may be empty.
    by_raycast : bool
        Whether the ray caster draws.
    """

    stateChanged = Signal(object)
    heldBack = Signal()
    """Emitted when an engine is started that waits for :meth:`begin`."""
    engineReady = Signal(object)
    requested = Signal(object)
    """Emitted with each request that is accepted, before the engine has it."""
    imageRequested = Signal(object)
    """Emitted with each request for an image that is accepted."""
    resultReady = Signal(object)
    """Emitted with each result; results of one kind arrive in order."""
    settled = Signal()
    """Emitted when the newest final image, or an error or a note instead, is available."""

    def __init__(self, name: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.state = EngineState.EMPTY
        self.text = ""
        self.description = self.remark = ""
        self.by_raycast = False
        self._name = name
        self._worker: EngineWorker | None = None
        self._retired: list[EngineWorker] = []
        self._wanted = -1
        self._takes_requests = True
        self._busy_text = ""
        self._is_built = False
        self._is_held = False
        self._early: dict[type[Request], Request] = {}

    @property
    def is_held(self) -> bool:
        """True while the engine waits for :meth:`begin` to be built."""
        return self._is_held

    @property
    def is_settled(self) -> bool:
        """True if no further result is expected for the newest image request."""
        return self.state in SETTLED_STATES

    @property
    def is_ready(self) -> bool:
        """True once the engine is built, and while it takes requests."""
        return self._is_built and self._takes_requests and self._worker is not None

    @property
    def error(self) -> str | None:
        """The error as one sentence; None if there is none."""
        return self.text if self.state is EngineState.FAILED else None

    def start(self, factory: Callable[[], Engine], busy_text: str, held: bool = False) -> None:
        """Replace the engine by one built by `factory` in a new worker thread.

        Parameters
        ----------
        factory : callable
        busy_text : str
            What is said meanwhile; empty to leave the last image as it is.
        held : bool
            Whether it is built at :meth:`begin` only, as others need the processor first. Until
            then requests wait, as for any engine that is built.
        """
        self.stop()
        self._takes_requests = True
        self._is_built = False
        self._early.clear()
        self.description = self.remark = ""
        self.by_raycast = False
        worker = EngineWorker(factory, self._name, self)
        worker.engineReady.connect(self._engine_ready)
        worker.engineFailed.connect(self._engine_failed)
        worker.resultReady.connect(self._take_result)
        worker.finished.connect(self._clear_retired)
        self._worker = worker
        self._busy_text = busy_text
        self._is_held = held
        self._enter(EngineState.LOADING, busy_text)
        if held:
            self.heldBack.emit()
        else:
            worker.start()

    def begin(self) -> None:
        """Build the engine that was held back, if there is one."""
        if self._is_held and self._worker is not None:
            self._is_held = False
            self._worker.start()

    def submit(self, request: Request) -> None:
        """Submit a request to the engine; ignored when paused or without an engine."""
        if self._worker is None or not self._takes_requests:
            return
        self.requested.emit(request)
        if isinstance(request, ImageRequest):
            self._wanted = request.sequence
            self.imageRequested.emit(request)
        if self._is_built:
            self._pass_on(request)
        else:
            # Until the engine is built, nobody knows whether it fits what is asked for.
            self._early[type(request)] = request

    def abandon(self, kind: type[Request]) -> None:
        """Call off the requests of a kind: a newer one will follow."""
        self._early.pop(kind, None)
        if self._worker is not None:
            self._worker.abandon(kind)

    def wait(self, text: str) -> None:
        """Stop the engine and enter the waiting state with an explanation."""
        self.stop()
        self._enter(EngineState.WAITING, text)

    def pause(self, text: str, settled: bool = True) -> None:
        """Ignore requests from now on, for a reason that is not an error.

        Parameters
        ----------
        text : str
            Explanation for the user.
        settled : bool
            False if an image is still expected.
        """
        self._takes_requests = False
        self._enter(EngineState.PAUSED if settled else EngineState.WAITING, text)

    def resume(self) -> None:
        """Accept requests again after :meth:`pause`."""
        if not self._takes_requests:
            self._takes_requests = True
            if self._worker is not None and not self._is_built:
                self._enter(EngineState.LOADING, self._busy_text)

    def fail(self, text: str) -> None:
        """Enter the failed state with an error sentence."""
        self._enter(EngineState.FAILED, text)

    def stop(self) -> None:
        """Stop the engine; returns at once, even if it is busy."""
        if self._worker is not None:
            self._worker.stop()
            if self._is_held:
                self._worker.deleteLater()
            else:
                self._retired.append(self._worker)
            self._is_held = False
            self._worker = None

    def join(self) -> None:
        """Wait until the threads of all stopped engines have ended."""
        for worker in self._retired:
            worker.join()
            worker.deleteLater()
        self._retired.clear()

    def _enter(self, state: EngineState, text: str = "") -> None:
        """Enter a state; emit `stateChanged` if the state or its text has changed."""
        assert state is self.state or state in TRANSITIONS[self.state], (self.state, state)
        changed = (state, text) != (self.state, self.text)
        self.state, self.text = state, text
        if changed:
            self.stateChanged.emit(state)
        if state in SETTLED_STATES:
            self.settled.emit()

    def _pass_on(self, request: Request) -> None:
        assert self._worker is not None
        if isinstance(request, ImageRequest):
            self._enter(EngineState.WORKING)
        self._worker.submit(request)

    def _engine_ready(self, ready: EngineReady) -> None:
        self.description, self.remark = ready.description, ready.remark
        self.by_raycast = ready.by_raycast
        worker = self._worker
        # Whoever listens may pause the client, ask for something newer, or start another engine.
        self.engineReady.emit(ready)
        if self._worker is not worker:
            return
        self._is_built = True
        early, self._early = self._early, {}
        if self._takes_requests and self._worker is not None:
            # What is to be seen comes before questions about it.
            for request in sorted(early.values(), key=_is_question):
                self._pass_on(request)

    def _engine_failed(self, error: str) -> None:
        # Without a worker, later requests are ignored and the error remains.
        self.stop()
        self.fail(error)

    def _take_result(self, result: Result) -> None:
        # What is drawn to be measured is not shown.
        if not isinstance(result.request, TradeRequest):
            self.description = result.description or self.description
            self.remark = result.remark or self.remark
            self.by_raycast = self.by_raycast or result.by_raycast
        if not self._takes_requests:
            return
        if not isinstance(result.request, ImageRequest):
            self.resultReady.emit(result)
            return
        if result.value is None:
            # An older image's error says nothing about the one that is on its way.
            if result.request.sequence == self._wanted:
                self.fail(result.error or "The engine returned no image.")
            return
        if self.state is not EngineState.WORKING:
            # From now on the image is shown instead of the text.
            self._enter(EngineState.WORKING)
        self.resultReady.emit(result)
        if not result.request.quality.live and result.request.sequence == self._wanted:
            self._enter(EngineState.SETTLED)

    def _clear_retired(self) -> None:
        """Delete stopped workers once their threads have ended."""
        worker = self.sender()
        if isinstance(worker, EngineWorker) and worker in self._retired:
            self._retired.remove(worker)
            worker.join()
            worker.deleteLater()


def _is_question(request: Request) -> bool:
    return not isinstance(request, ImageRequest | StandInRequest)
