"""The window's side of an engine: its worker, its state, and its newest results. No widget."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from app.engines.engine import Engine
from app.engines.messages import EngineReady, ImageRequest, Request, Result
from app.engines.states import SETTLED_STATES, TRANSITIONS, EngineState
from app.engines.worker import EngineWorker


class EngineClient(QObject):
    """Runs one engine at a time in a worker thread, and says what state it is in.

    The state follows the images; other kinds of requests come and go beside it.

    Parameters
    ----------
    name : str
        Of the worker's thread.

    Attributes
    ----------
    state : EngineState
    text : str
        What the state is to be explained by: what is waited for, why nothing is drawn,
        or the error. Empty while images come.
    description : str
        Where the engine runs, in a word or two.
    """

    stateChanged = Signal(object)
    engineReady = Signal(object)
    resultReady = Signal(object)
    """A result of any kind, newer than all before it of its kind."""
    settled = Signal()
    """The newest final image is there, or there is an error or a note instead."""

    def __init__(self, name: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.state = EngineState.EMPTY
        self.text = ""
        self.description = ""
        self._name = name
        self._worker: EngineWorker | None = None
        self._retired: list[EngineWorker] = []
        self._wanted = -1
        self._takes_requests = True

    @property
    def is_settled(self) -> bool:
        """Whether nothing more is to be expected for the newest image."""
        return self.state in SETTLED_STATES

    @property
    def error(self) -> str | None:
        """The error, one sentence."""
        return self.text if self.state is EngineState.FAILED else None

    def start(self, factory: Callable[[], Engine], busy_text: str) -> None:
        """Replace the engine by one that `factory` builds in a new worker thread."""
        self.stop()
        self._takes_requests = True
        self.description = ""
        worker = EngineWorker(factory, self._name, self)
        worker.engineReady.connect(self._engine_ready)
        worker.engineFailed.connect(self._engine_failed)
        worker.resultReady.connect(self._take_result)
        worker.finished.connect(self._clear_retired)
        self._worker = worker
        self._enter(EngineState.LOADING, busy_text)
        worker.start()

    def submit(self, request: Request) -> None:
        """Ask the engine for something; paused or without an engine, nothing happens."""
        if self._worker is None or not self._takes_requests:
            return
        if isinstance(request, ImageRequest):
            self._wanted = request.sequence
            if self.state is not EngineState.LOADING:
                self._enter(EngineState.WORKING)
        self._worker.submit(request)

    def wait(self, text: str) -> None:
        """Let the engine go and say what is being waited for."""
        self.stop()
        self._enter(EngineState.WAITING, text)

    def pause(self, text: str, settled: bool = True) -> None:
        """Ignore requests and say why, when that is no error.

        Parameters
        ----------
        text : str
        settled : bool
            False when an image is still to come.
        """
        self._takes_requests = False
        self._enter(EngineState.PAUSED if settled else EngineState.WAITING, text)

    def resume(self) -> None:
        """Take requests again after :meth:`pause`."""
        self._takes_requests = True

    def fail(self, text: str) -> None:
        """Report an error in the place of an image."""
        self._enter(EngineState.FAILED, text)

    def stop(self) -> None:
        """Let the engine go; returns at once, whatever it is doing."""
        if self._worker is not None:
            self._worker.stop()
            self._retired.append(self._worker)
            self._worker = None

    def join(self) -> None:
        """Wait until the threads of all stopped engines have ended."""
        for worker in self._retired:
            worker.join()
            worker.deleteLater()
        self._retired.clear()

    def _enter(self, state: EngineState, text: str = "") -> None:
        """Go into a state, and tell it where it, or its text, is new."""
        assert state is self.state or state in TRANSITIONS[self.state], (self.state, state)
        changed = (state, text) != (self.state, self.text)
        self.state, self.text = state, text
        if changed:
            self.stateChanged.emit(state)
        if state in SETTLED_STATES:
            self.settled.emit()

    def _engine_ready(self, ready: EngineReady) -> None:
        self.description = ready.description
        self.engineReady.emit(ready)

    def _engine_failed(self, error: str) -> None:
        # Without the worker later requests end at once, and the error stays.
        self.stop()
        self.fail(error)

    def _take_result(self, result: Result) -> None:
        if not self._takes_requests:
            return
        if not isinstance(result.request, ImageRequest):
            self.resultReady.emit(result)
            return
        if result.value is None:
            self.fail(result.error or "The engine returned no image.")
            return
        if self.state is not EngineState.WORKING:
            # What is shown from now on is an image, no longer the text.
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
