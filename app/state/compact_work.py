"""A compact volume that is compressed, measured and written in a thread."""

from __future__ import annotations

import threading
from functools import partial

from PySide6.QtCore import QObject, Signal

from app.engines.background import BackgroundCall
from model.evaluation.compact_saving import CompactOrder, CompactResult, save_compact
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
        self._call: BackgroundCall | None = None
        self._cancelled = threading.Event()

    @property
    def is_running(self) -> bool:
        """True from the start until the file is there, or given up."""
        return self._call is not None

    def start(self, volume: Volume, order: CompactOrder) -> None:
        """Begin; nothing must be under way."""
        assert self._call is None
        cancelled = self._cancelled = threading.Event()

        def work() -> CompactResult:
            return save_compact(volume, order, partial(self._tell, cancelled))

        call = self._call = BackgroundCall(work, "compact", self)
        call.done.connect(self.done)
        call.failed.connect(self.failed)
        call.finished.connect(partial(self._forget, call))
        call.start()

    def cancel(self) -> None:
        """Give it up; within the time of an image, or of one compression."""
        self._cancelled.set()
        if self._call is not None:
            self._call.abandon()

    def join(self) -> None:
        """Wait until the thread has ended."""
        if self._call is not None:
            self._call.join()

    def _tell(self, cancelled: threading.Event, what: str, done: float) -> None:
        if cancelled.is_set():
            raise _GivenUpError
        self.progressed.emit(what, done)

    def _forget(self, call: BackgroundCall) -> None:
        if self._call is call:
            self._call = None
        call.deleteLater()


class _GivenUpError(Exception):
    """Ends work that nobody wants any more."""
