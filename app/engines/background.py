"""Calls in background threads, whose results reach the window, and delayed calls."""

import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Qt, QTimer, Signal, Slot

from app.engines.messages import error_sentence
from app.engines.worker import THREAD_PREFIX


class Pause(QTimer):
    """Calls a function once, some milliseconds after the last start."""

    def __init__(self, parent: QObject, length: int, call: Callable[[], object]) -> None:
        super().__init__(parent, singleShot=True, interval=length)
        self.timeout.connect(call)


class LatestCall(QObject):
    """Calls functions in threads, and delivers their results or error sentences.

    One runs at a time. Of the calls that wait, only the newest is made. With `at_once` each starts
    immediately, and only the newest result is delivered.
    """

    _returned = Signal(object, object, object)

    def __init__(
        self,
        name: str,
        parent: QObject,
        take: Callable[[Any], object],
        refuse: Callable[[str], object],
        at_once: bool = False,
    ) -> None:
        super().__init__(parent)
        self._name, self._take, self._refuse, self._at_once = name, take, refuse, at_once
        self._threads: list[threading.Thread] = []
        self._wanted: threading.Thread | None = None
        self._next: Callable[[], Any] | None = None
        self._stopped = False
        self._returned.connect(self._deliver, Qt.ConnectionType.QueuedConnection)

    @property
    def is_running(self) -> bool:
        """True until all calls have returned, including those whose results are discarded."""
        return bool(self._threads)

    @property
    def is_awaited(self) -> bool:
        """True while a result is still wanted."""
        return self._wanted is not None

    def ask(self, function: Callable[[], Any]) -> None:
        """Call a function, now or as soon as the present call has ended."""
        if self._stopped:
            return
        if self._threads and not self._at_once:
            self._next = function
            return
        name = THREAD_PREFIX + self._name
        self._wanted = threading.Thread(target=self._run, args=(function,), name=name, daemon=True)
        self._threads.append(self._wanted)
        self._wanted.start()

    def forget(self) -> None:
        """Discard the results of all calls so far."""
        self._next = self._wanted = None

    def stop(self) -> None:
        """Start no more calls, and discard results."""
        self._stopped = True
        self.forget()

    def join(self) -> None:
        """Wait until all calls have returned."""
        for thread in self._threads:
            thread.join()

    def _run(self, function: Callable[[], Any]) -> None:
        own = threading.current_thread()
        try:
            self._returned.emit(own, function(), None)
        except Exception as error:
            self._returned.emit(own, None, error_sentence(error))

    @Slot(object, object, object)
    def _deliver(self, thread: threading.Thread, result: Any, error: str | None) -> None:
        thread.join()
        is_wanted = thread is self._wanted
        try:
            if is_wanted:
                self._wanted = None
                if error is None:
                    self._take(result)
                else:
                    self._refuse(error)
        finally:
            self._threads.remove(thread)
            function, self._next = self._next, None
            if function is not None:
                self.ask(function)
