"""One thread per engine, fed by a mailbox that holds only the newest request."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Qt, Signal, Slot

from app.engines.messages import (
    EngineFailed,
    EngineReady,
    RenderRequest,
    RenderResult,
    error_sentence,
)
from model.scene.scene import Scene

THREAD_PREFIX = "tfscope-"


class Engine(Protocol):
    """What renders: built, used and closed in one and the same thread."""

    @property
    def description(self) -> str:
        """Where it runs, in a word or two; may be empty."""

    @property
    def scene(self) -> Scene | None:
        """The scene that a generator was trained for."""

    def render(self, request: RenderRequest) -> NDArray[np.float32]:
        """Return the image, shape (S, S, 4), as :class:`RenderResult` describes it."""

    def close(self) -> None:
        """Free what the engine holds."""


class Mailbox:
    """A place for one request: a newer one replaces it."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._request: RenderRequest | None = None
        self._closed = False

    def put(self, request: RenderRequest) -> None:
        """Leave a request, instead of any that was not taken yet."""
        with self._changed:
            self._request = request
            self._changed.notify()

    def take(self) -> RenderRequest | None:
        """Wait for a request and take it out; None once the mailbox is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._request is not None)
            request, self._request = self._request, None
            return None if self._closed else request

    def close(self) -> None:
        """Wake whoever waits; nothing can be taken any more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def closed(self) -> bool:
        """Whether :meth:`close` was called."""
        return self._closed


class RenderWorker(QObject):
    """Builds an engine in a thread of its own and renders the newest request there.

    All signals arrive in the thread that the worker lives in. After
    :meth:`stop` only `finished` does.

    Parameters
    ----------
    factory : callable
        Builds the engine; called in the worker thread, may take seconds.
    name : str
        Of the thread, for debuggers.
    """

    engineReady = Signal(object)
    engineFailed = Signal(str)
    resultReady = Signal(object)
    finished = Signal()

    _message = Signal(object)

    def __init__(
        self, factory: Callable[[], Engine], name: str, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._factory = factory
        self._mailbox = Mailbox()
        self._delivered = -1
        self._thread = threading.Thread(target=self._run, name=THREAD_PREFIX + name, daemon=True)
        self._message.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    def start(self) -> None:
        """Start the thread, which builds the engine first."""
        self._thread.start()

    def submit(self, request: RenderRequest) -> None:
        """Ask for an image; returns at once. An older request not begun yet is forgotten."""
        self._mailbox.put(request)

    def stop(self) -> None:
        """Ask the thread to end; returns at once, also while the engine is busy."""
        self._mailbox.close()

    def join(self) -> None:
        """Wait until the thread has ended and its engine is closed."""
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        try:
            self._serve()
        finally:
            self._message.emit(None)

    def _serve(self) -> None:
        try:
            engine = self._factory()
        except Exception as error:
            self._message.emit(EngineFailed(error_sentence(error)))
            return
        try:
            self._message.emit(EngineReady(engine.description, engine.scene))
            while (request := self._mailbox.take()) is not None:
                self._message.emit(_answer(engine, request))
        finally:
            engine.close()

    @Slot(object)
    def _deliver(self, message: EngineReady | EngineFailed | RenderResult | None) -> None:
        if message is None:
            self.finished.emit()
        elif self._mailbox.closed:
            pass
        elif isinstance(message, EngineReady):
            self.engineReady.emit(message)
        elif isinstance(message, EngineFailed):
            self.engineFailed.emit(message.error)
        elif message.sequence > self._delivered:
            self._delivered = message.sequence
            self.resultReady.emit(message)


def _answer(engine: Engine, request: RenderRequest) -> RenderResult:
    """Render a request; an exception becomes data."""
    image, error = None, None
    start = time.perf_counter()
    try:
        image = engine.render(request)
    except Exception as exception:
        error = error_sentence(exception)
    seconds = time.perf_counter() - start
    return RenderResult(request.sequence, request.live, image, error, seconds)
