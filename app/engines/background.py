"""Calls in threads of their own, with their results delivered to the window, and after pauses."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Qt, QTimer, Signal, Slot

from app.engines.messages import error_sentence
from app.engines.worker import THREAD_PREFIX


class Pause(QTimer):
    """Calls a function once, some milliseconds after it was started last."""

    def __init__(self, parent: QObject, length: int, call: Callable[[], object]) -> None:
        super().__init__(parent, singleShot=True, interval=length)
        self.timeout.connect(call)


class BackgroundCall(QObject):
    """Calls a function in a thread and emits its result or its error as a signal.

    After :meth:`abandon` neither `done` nor `failed` is emitted, only `finished`.
    """

    done = Signal(object)
    failed = Signal(str)
    finished = Signal()

    _message = Signal(object, object)

    def __init__(
        self, function: Callable[[], Any], name: str, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._function = function
        self._abandoned = False
        self._thread = threading.Thread(target=self._run, name=THREAD_PREFIX + name, daemon=True)
        self._message.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def abandon(self) -> None:
        """Discard the result; does not wait for the thread."""
        self._abandoned = True

    def join(self) -> None:
        """Wait until the function has returned."""
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        try:
            self._message.emit(self._function(), None)
        except Exception as error:
            self._message.emit(None, error_sentence(error))

    @Slot(object, object)
    def _deliver(self, result: Any, error: str | None) -> None:
        if not self._abandoned:
            if error is None:
                self.done.emit(result)
            else:
                self.failed.emit(error)
        self.finished.emit()


class LatestCall(QObject):
    """Runs one call at a time in a thread; of those asked for meanwhile, the newest comes next."""

    def __init__(
        self,
        name: str,
        parent: QObject,
        take: Callable[[Any], object],
        refuse: Callable[[str], object],
    ) -> None:
        super().__init__(parent)
        self._name, self._take, self._refuse = name, take, refuse
        self._running: BackgroundCall | None = None
        self._next: Callable[[], Any] | None = None
        self._stopped = False

    @property
    def is_running(self) -> bool:
        """True while a result is expected."""
        return self._running is not None

    def ask(self, function: Callable[[], Any]) -> None:
        """Call a function as soon as the present call has ended, unless a newer one is asked."""
        if self._stopped:
            return
        self._next = function
        if self._running is None:
            self._start()

    def forget(self) -> None:
        """Discard the results of what was asked so far."""
        self._next = None
        if self._running is not None:
            self._running.abandon()

    def stop(self) -> None:
        """Start nothing any more, and discard results."""
        self._stopped = True
        self.forget()

    def join(self) -> None:
        """Wait until the present call has returned."""
        if self._running is not None:
            self._running.join()

    def _start(self) -> None:
        function, self._next = self._next, None
        assert function is not None
        call = BackgroundCall(function, self._name, self)
        call.done.connect(self._take)
        call.failed.connect(self._refuse)
        call.finished.connect(self._end)
        self._running = call
        call.start()

    def _end(self) -> None:
        call, self._running = self._running, None
        if call is not None:
            call.join()
            call.deleteLater()
        if self._next is not None and not self._stopped:
            self._start()
