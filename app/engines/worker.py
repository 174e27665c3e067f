"""Worker threads of engines, with a mailbox that holds the newest request of each channel."""

import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import islice

import numpy as np
from PySide6.QtCore import QObject, Qt, Signal, Slot

from app.engines import messages
from app.engines.requests import (
    IMAGES_B,
    Engine,
    Image,
    ReferenceSettings,
    Request,
    SupersededError,
    Watch,
)

THREAD_PREFIX = "tfscope-"

PROGRESS_S = 0.1  # time between two messages of an answer's progress


class Mailbox:
    """Thread-safe mailbox with one slot per channel; a newer request replaces an older one."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._slots: dict[str, Request] = {}
        self._abandoned: set[str] = set()
        self.closed = self._is_woken = False

    def put(self, request: Request) -> None:
        """Put a request, replacing any of its channel that has not been taken yet."""
        with self._changed:
            # A channel that is already waiting keeps its position.
            self._slots[request.channel] = request
            # Engines of settings are in use again.
            self._is_woken = self._is_woken and request.settings is None
            self._changed.notify()

    def take(self, waits: bool = True) -> Request | None:
        """Remove the request of the channel which has waited longest; None once it is woken."""
        with self._changed:
            self._changed.wait_for(
                lambda: self.closed or self._slots or self._is_woken or not waits
            )
            if self.closed or not self._slots:
                self._is_woken = self._is_woken and not waits
                return None
            channel = next(iter(self._slots))
            self._abandoned.discard(channel)
            return self._slots.pop(channel)

    def wake(self) -> None:
        """End a wait for requests, or the next one: engines of settings are closed if unused."""
        with self._changed:
            self._is_woken = True
            self._changed.notify_all()

    def abandon(self, channel: str) -> None:
        """Drop the waiting request of a channel, and cancel the one that was taken last."""
        with self._changed:
            self._slots.pop(channel, None)
            self._abandoned.add(channel)

    def wants(self, request: Request) -> bool:
        """Return False if a request was cancelled, or replaced before it started."""
        if self.closed:
            return False
        newer = self._slots.get(request.channel)
        if request.quality.live:
            return newer is None or newer.quality.live
        return newer is None and request.channel not in self._abandoned

    def has_requests(self) -> bool:
        """Return whether a request waits."""
        return bool(self._slots)

    def close(self) -> None:
        """End the thread, even if its engine is busy; no request can be taken any more."""
        with self._changed:
            self.closed = True
            self._changed.notify_all()


class EngineWorker(QObject):
    """Builds an engine in its own thread and answers the newest requests of a mailbox there.

    Images get better until there is a newer request of their channel. Between two images, and where
    one takes long, other channels take their turn.

    `told` is emitted in this object's thread: once the mailbox is closed, with None alone, when the
    worker's thread has ended. The factory, which runs in the worker's thread, builds the engine,
    and one more for each of the settings in use.
    """

    told = Signal(object)  # emitted with each :data:`app.engines.messages.Message`

    _message = Signal(object)

    def __init__(
        self, factory: Callable[..., Engine], name: str, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._factory = factory
        self.mailbox = Mailbox()
        self._delivered: dict[str, int] = {}
        self._engines: dict[ReferenceSettings | None, Engine] = {}
        # Requests whose better images may follow, by their channel.
        self._begun: dict[str, tuple[Request, Iterator[messages.Result | None]]] = {}
        self._thread = threading.Thread(target=self._run, name=THREAD_PREFIX + name, daemon=True)
        self._message.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    def start(self) -> None:
        """Start the thread, which builds the engine first."""
        self._thread.start()

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
            engine = self._engines[None] = self._factory()
            ready = messages.EngineReady(engine.scene)
        except BaseException as error:
            # Any exception: the window would wait forever for a thread that ended silently.
            self._message.emit(messages.EngineFailed(messages.error_sentence(error)))
            return
        try:
            self._message.emit(ready)
            del engine
            self._answer_all()
        finally:
            self._begun.clear()
            for engine in self._engines.values():
                engine.close()
            self._engines.clear()

    def _answer_all(self) -> None:
        begun = self._begun
        while not self.mailbox.closed:
            request = self.mailbox.take(waits=not begun)
            if request is not None:
                begun.pop(request.channel, None)
                coming = _results(self._engine_of, request, self._watch(request))
            elif begun:
                request, coming = begun.pop(next(iter(begun)))
            else:
                # Without a request, the mailbox wakes this thread when B is hidden.
                self._close_unused()
                self._engines[None].forget(IMAGES_B)
                continue
            for result in islice(coming, 1):
                if result is not None:
                    self._message.emit(result)
                if result is None or not result.is_last:
                    begun[request.channel] = request, coming
                del result
            # Otherwise this thread would keep them until the next request.
            del request, coming

    def _engine_of(self, request: Request) -> Engine:
        """Return the engine for a request's settings; close engines that are not in use."""
        if request.settings not in self._engines:
            self._close_unused()
            self._engines[request.settings] = self._factory(request.settings)
        return self._engines[request.settings]

    def _close_unused(self) -> None:
        used = {None, *(request.settings for request, _ in self._begun.values())}
        for settings in self._engines.keys() - used:
            self._engines.pop(settings).close()

    def _watch(self, request: Request) -> Watch:
        last = time.monotonic()

        def note(part: float) -> None:
            nonlocal last
            now = time.monotonic()
            if now - last >= PROGRESS_S:
                last = now
                self._message.emit(messages.Progress(request, part))

        return Watch(partial(self.mailbox.wants, request), note, self.mailbox.has_requests)

    @Slot(object)
    def _deliver(self, message: messages.Message) -> None:
        if isinstance(message, messages.Result):
            number, channel = message.request.sequence, message.request.channel
            if number < self._delivered.get(channel, -1):
                return
            self._delivered[channel] = number
        if message is None or not self.mailbox.closed:
            self.told.emit(message)


def _results(
    engine_of: Callable[[Request], Engine], request: Request, watch: Watch
) -> Iterator[messages.Result | None]:
    """Answer a request, with exceptions as error sentences, while the answer is wanted.

    None is yielded to let other requests come first.
    """
    start = time.perf_counter()
    try:
        engine = engine_of(request)
        answer = request.answer(engine, watch)
        if isinstance(answer, np.ndarray):
            seconds = time.perf_counter() - start
            answer = iter([Image(answer, seconds, engine.description, error=engine.image_error)])
        for image in answer:
            if image is None:
                yield None
            else:
                yield messages.Result(request, image, None, engine.remark)
            if not watch.is_wanted():
                return
    except (SupersededError, GeneratorExit):
        return
    except BaseException as exception:
        yield messages.Result(request, None, messages.error_sentence(exception))
