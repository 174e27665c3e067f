"""The window's side of an engine: its worker, its state, and channels for requests."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from itertools import count
from typing import Literal, TypeVar

from PySide6.QtCore import QObject, Signal

from app.engines.messages import EngineFailed, EngineReady, Message, Progress, Result
from app.engines.requests import IMAGES, IMAGES_B, Engine, ImageRequest, Request
from app.engines.worker import EngineWorker

EngineName = Literal["exact", "learned"]  # the ray caster, or a generator

_numbers = count(1)

_R = TypeVar("_R", bound=Request)
_K = TypeVar("_K", bound=Hashable)


class EngineState(Enum):
    """State of an engine client."""

    EMPTY = "empty"  # there is no engine yet
    WAITING = "waiting"  # the engine waits for another thing, such as a volume
    LOADING = "loading"  # the engine is being built; requests wait for it
    WORKING = "working"  # the newest image is being drawn
    SETTLED = "settled"  # the newest final image is available
    PAUSED = "paused"  # the engine accepts no requests, for a reason that is not an error
    FAILED = "failed"  # an error replaces the newest image


SETTLED_STATES = frozenset({EngineState.SETTLED, EngineState.PAUSED, EngineState.FAILED})
"""States in which no further result is expected."""


class Channel(QObject):
    """Sends requests to a client's engine, and receives the answers to these alone.

    It also works with the engine's successor. A new request replaces a waiting one of the channel,
    and cancels a running one unless that is live. The channels of an engine take turns. The name
    says what the requests are for. `newest` is None once it is cancelled.
    """

    asked = Signal(object)  # emitted with each accepted :class:`Request`, as it was numbered
    answered = Signal(object)  # emitted with each :class:`Result`, in the order of the requests
    progressed = Signal(float)  # emitted with the part, 0 to 1, of the newest answer
    pendingChanged = Signal(bool)  # emitted when an answer is awaited, and when none is any more

    def __init__(self, client: EngineClient, name: str, parent: QObject) -> None:
        super().__init__(parent)
        self.client, self.name = client, name
        self.newest: Request | None = None
        self._pending: Request | None = None
        self._cancelled = 0
        client.open(self)

    @property
    def is_pending(self) -> bool:
        """Whether the newest request has no answer yet, and is not cancelled."""
        return self._pending is not None

    def ask(self, request: _R) -> _R:
        """Send a request, which replaces the one before; return it with its number."""
        request = replace(request, sequence=next(_numbers), channel=self.name)
        self.client.submit(request)
        return request

    def cancel(self) -> None:
        """Cancel the newest request."""
        self._cancelled = next(_numbers)
        if self.newest is not None:
            self.client.abandon(self.name)
            self.drop()

    def accept(self, request: Request) -> None:
        """Note that the engine will answer a request."""
        self.newest = request
        self._await(request)
        self.asked.emit(request)

    def drop(self) -> None:
        """Note that the newest request will not be answered."""
        self.newest = None
        self._await(None)

    def note(self, progress: Progress) -> None:
        """Report the progress of the newest answer."""
        if self._pending is not None and self._pending.sequence == progress.request.sequence:
            self.progressed.emit(progress.part)

    def deliver(self, result: Result) -> None:
        """Deliver an answer, unless its request was cancelled."""
        number = result.request.sequence
        if result.is_last and self._pending is not None and number >= self._pending.sequence:
            self._await(None)
        if number >= self._cancelled:
            self.answered.emit(result)

    def _await(self, request: Request | None) -> None:
        before, self._pending = self._pending, request
        if (before is None) != (request is None):
            self.pendingChanged.emit(self.is_pending)


class Channels(dict[_K, Channel]):
    """Channels to several engines, with the same keys as their clients."""

    def __init__(
        self,
        clients: Mapping[_K, EngineClient],
        name: str,
        take: Callable[[_K, Result], object],
        parent: QObject,
    ) -> None:
        super().__init__()
        for key, each in clients.items():
            # One engine may draw two of the images.
            is_taken = any(channel.client is each for channel in self.values())
            self[key] = Channel(each, f"{name}: {key}" if is_taken else name, parent)
        for key, channel in self.items():
            channel.answered.connect(partial(take, key))

    @property
    def is_pending(self) -> bool:
        """Whether an answer from any of the engines is still to come."""
        return any(channel.is_pending for channel in self.values())

    def cancel(self) -> None:
        """Cancel the newest requests of all channels."""
        for channel in self.values():
            channel.cancel()


class EngineClient(QObject):
    """Runs one engine at a time in a worker thread and tracks its state.

    Requests are sent through a :class:`Channel`. The state depends on the channel `images` alone,
    not on that of B's images. `text` says what the engine waits for, why it draws nothing, or the
    error.
    """

    stateChanged = Signal(object)
    engineReady = Signal(object)
    settled = Signal()  # emitted with the final image, or with an error or note instead

    def __init__(self, name: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.state = EngineState.EMPTY
        self.text = ""
        self.by_raycast = False
        self._name = name
        self._worker: EngineWorker | None = None
        self._retired: list[EngineWorker] = []
        self._wanted = -1
        self._takes_requests = True
        self._busy_text = ""
        self._is_built = self._is_held = False
        self._early: dict[str, Request] = {}
        self._channels: dict[str, Channel] = {}
        self.images = Channel(self, IMAGES, self)
        self.images_b = Channel(self, IMAGES_B, self)

    @property
    def is_settled(self) -> bool:
        """True if no further result is expected for the newest image request."""
        return self.state in SETTLED_STATES

    @property
    def is_ready(self) -> bool:
        """True once the engine is built, and while it takes requests."""
        return self._is_built and self._takes_requests and self._worker is not None

    def open(self, channel: Channel) -> None:
        """Deliver the answers to a channel's requests there."""
        assert channel.name not in self._channels, channel.name
        self._channels[channel.name] = channel

    def start(self, factory: Callable[..., Engine], busy_text: str) -> None:
        """Replace the engine by the one that `factory` builds in a new worker thread."""
        self.stop()
        self._takes_requests = True
        self._is_built = False
        self._early.clear()
        self.by_raycast = False
        worker = EngineWorker(factory, self._name, self)
        worker.told.connect(self._take)
        self._worker = worker
        self._busy_text = busy_text
        # Emitted at each start: requests to the previous engine are lost.
        self.state = EngineState.EMPTY
        self._enter(EngineState.LOADING, busy_text)
        worker.start()

    def submit(self, request: Request) -> None:
        """Submit a channel's request to the engine; ignored when paused or without an engine."""
        if self._worker is None or not self._takes_requests:
            return
        if request.channel == IMAGES:
            self._wanted = request.sequence
        self._channels[request.channel].accept(request)
        if self._is_built and not self._is_held:
            self._pass_on(request)
        else:
            # Until the engine is built, it is unknown whether it can answer.
            self._early[request.channel] = request

    def hold(self, is_held: bool) -> None:
        """Hold requests back while something else needs the processors, or release them."""
        self._is_held = is_held
        if self._is_built:
            self._pass_on_early()

    def abandon(self, channel: str) -> None:
        """Cancel the requests of a channel."""
        self._early.pop(channel, None)
        if self._worker is not None:
            self._worker.mailbox.abandon(channel)

    def free(self) -> None:
        """Close engines that were built for requests with settings, once they have answered."""
        if self._worker is not None:
            self._worker.mailbox.wake()

    def wait(self, text: str) -> None:
        """Stop the engine and enter the waiting state with an explanation."""
        self.stop()
        self._enter(EngineState.WAITING, text)

    def pause(self, text: str, settled: bool = True) -> None:
        """Ignore requests from now on, for a reason that is not an error."""
        self._takes_requests = False
        for channel in self._channels.values():
            channel.drop()
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
            self._worker.mailbox.close()
            self._retired.append(self._worker)
            self._worker = None
            for channel in self._channels.values():
                channel.drop()

    def join(self) -> None:
        """Wait until the threads of all stopped engines have ended."""
        for worker in self._retired:
            worker.join()
            worker.deleteLater()
        self._retired.clear()

    def _enter(self, state: EngineState, text: str = "") -> None:
        changed = (state, text) != (self.state, self.text)
        self.state, self.text = state, text
        if changed:
            self.stateChanged.emit(state)
        if state in SETTLED_STATES:
            self.settled.emit()

    def _pass_on(self, request: Request) -> None:
        assert self._worker is not None
        if request.channel == IMAGES:
            self._enter(EngineState.WORKING)
        self._worker.mailbox.put(request)

    def _take(self, message: Message) -> None:
        if message is None:
            self._clear_retired()
        elif isinstance(message, EngineReady):
            self._engine_ready(message)
        elif isinstance(message, EngineFailed):
            # Without a worker, later requests are ignored and the error remains.
            self.stop()
            self.fail(message.error)
        elif isinstance(message, Result):
            self._take_result(message)
        elif self._takes_requests:
            self._channels[message.request.channel].note(message)

    def _engine_ready(self, ready: EngineReady) -> None:
        worker = self._worker
        # A listener may pause the client, send a newer request, or start another engine.
        self.engineReady.emit(ready)
        if self._worker is not worker:
            return
        self._is_built = True
        self._pass_on_early()

    def _pass_on_early(self) -> None:
        if self._takes_requests and self._worker is not None and not self._is_held:
            early, self._early = self._early, {}
            # Images come before questions about them.
            for request in sorted(early.values(), key=lambda each: each.asks != ImageRequest.asks):
                self._pass_on(request)

    def _take_result(self, result: Result) -> None:
        request = result.request
        image = result.image
        if not self._takes_requests:
            return
        if request.channel != IMAGES:
            self._channels[request.channel].deliver(result)
            return
        if image is None:
            # An older image's error says nothing about the newer one.
            if request.sequence == self._wanted:
                self.images.drop()
                self.fail(result.error or "The engine returned no image.")
            return
        if self.state is not EngineState.WORKING:
            # From now on the image is shown instead of the text.
            self._enter(EngineState.WORKING)
        if not image.is_preview:
            self.by_raycast = image.by_raycast
        self.images.deliver(result)
        if result.is_last and not request.quality.live and request.sequence == self._wanted:
            self._enter(EngineState.SETTLED)

    def _clear_retired(self) -> None:
        """Delete stopped workers once their threads have ended."""
        worker = self.sender()
        if isinstance(worker, EngineWorker) and worker in self._retired:
            self._retired.remove(worker)
            worker.join()
            worker.deleteLater()


@dataclass(frozen=True)
class Clients:
    """Clients of a window's engines; the analyst is the ray caster that answers questions."""

    generator: EngineClient
    reference: EngineClient
    analyst: EngineClient
