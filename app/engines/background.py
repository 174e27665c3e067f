"""A single call in its own thread, with its result delivered to the window."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Qt, Signal, Slot

from app.engines.messages import error_sentence
from app.engines.worker import THREAD_PREFIX


class BackgroundCall(QObject):
    """Calls a function in a thread and emits its result or its error as a signal.

    After :meth:`abandon` neither `done` nor `failed` is emitted, only
    `finished`.

    Parameters
    ----------
    function : callable
        A function without arguments; called in the new thread.
    name : str
        Name of the thread, for debuggers.
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
