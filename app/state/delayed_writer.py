"""Writing files shortly after a change, without making the window wait for the disk."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.background import BackgroundCall
from app.engines.messages import error_sentence

PAUSE_MS = 300
"""Time after the first of some changes in a row before they are written, as one file."""


class DelayedWriter(QObject):
    """Has what was changed written in a thread of its own, one write at a time.

    After a failed write nothing more is written: `problem` has said so.

    Parameters
    ----------
    take : callable
        Called in this thread when it is time to write. It hands over what is not written
        yet, as a function that writes it and is called in another thread.
    name : str
        Name of the threads, for debuggers.
    """

    problem = Signal(str)

    def __init__(self, take: Callable[[], Callable[[], None]], name: str, parent: QObject) -> None:
        super().__init__(parent)
        self._take = take
        self._name = name
        self._writing: BackgroundCall | None = None
        self._has_failed = False
        self._pause = QTimer(self, singleShot=True, interval=PAUSE_MS)
        self._pause.timeout.connect(self._write)

    def note(self) -> None:
        """Have a change written soon; returns at once."""
        # Not anew at every change: a long drag would then be written at its end only.
        if not (self._has_failed or self._pause.isActive()):
            self._pause.start()

    def finish(self) -> None:
        """Write what is not written yet, and wait for it."""
        pending = self._pause.isActive()
        self._pause.stop()
        if self._writing is not None:
            self._writing.join()
        if pending and not self._has_failed:
            try:
                self._take()()
            except Exception as error:
                self._fail(error_sentence(error))

    def _write(self) -> None:
        if self._writing is not None:
            # One write at a time, so that an older state never replaces a newer one.
            self._pause.start()
            return
        call = BackgroundCall(self._take(), self._name, self)
        call.failed.connect(self._fail)
        call.finished.connect(self._end_writing)
        self._writing = call
        call.start()

    def _end_writing(self) -> None:
        if self._writing is not None:
            self._writing.join()
            self._writing.deleteLater()
            self._writing = None

    def _fail(self, text: str) -> None:
        # Once: the same disk may fail for a thread and for the end of it all.
        if not self._has_failed:
            self._has_failed = True
            self._pause.stop()
            self.problem.emit(text)
