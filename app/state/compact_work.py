"""A compact volume that is compressed, measured and written in a thread."""

from __future__ import annotations

import threading
from functools import partial

from PySide6.QtCore import QObject, Signal

from app.state.latest_call import LatestCall
from model.evaluation.compact_saving import CompactOrder, save_compact
from model.scene.volume import Volume


class CompactWork(QObject):
    """Saves one compact volume at a time, and can be cancelled."""

    progressed = Signal(str, float)
    """Emitted with what is being done and the fraction of it that is done."""
    done = Signal(object)
    """Emitted with the :class:`~model.evaluation.compact_saving.CompactResult`."""
    failed = Signal(str)
    """Emitted with an error sentence; what was at the place before is still there."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._call = LatestCall("compact", self)
        self._call.done.connect(self.done)
        self._call.failed.connect(self.failed)
        self._cancelled = threading.Event()

    @property
    def is_running(self) -> bool:
        """True from the start until the file is there, or given up."""
        return self._call.is_running

    def start(self, volume: Volume, order: CompactOrder) -> None:
        """Begin; nothing must be under way."""
        assert not self.is_running
        cancelled = self._cancelled = threading.Event()
        self._call.ask(partial(save_compact, volume, order, partial(self._tell, cancelled)))

    def cancel(self) -> None:
        """Give it up; within the time of an image, or of one compression."""
        self._cancelled.set()
        self._call.forget()

    def join(self) -> None:
        """Wait until the thread has ended."""
        self._call.join()

    def _tell(self, cancelled: threading.Event, what: str, done: float) -> None:
        if cancelled.is_set():
            raise _GivenUpError
        self.progressed.emit(what, done)


class _GivenUpError(Exception):
    """Ends work that nobody wants any more."""
