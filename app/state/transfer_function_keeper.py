"""Keeps edited TFs without making the window wait for the disk."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.background import BackgroundCall
from app.engines.messages import error_sentence
from app.state.transfer_function_store import TransferFunctionStore
from model.errors import TransferFunctionError
from model.scene.transfer_function import TransferFunction

PAUSE_MS = 300
"""Time after an edit before it is written: nudges in a row make one file."""


class TransferFunctionKeeper(QObject):
    """Writes the newest TF of each volume to a store, in a thread of its own.

    After a failed write nothing more is kept: `problem` has said so.

    Parameters
    ----------
    store : TransferFunctionStore or None
        None keeps nothing.
    """

    problem = Signal(str)

    def __init__(self, store: TransferFunctionStore | None, parent: QObject) -> None:
        super().__init__(parent)
        self._store = store
        self._unwritten: dict[str, TransferFunction] = {}
        self._being_written: dict[str, TransferFunction] = {}
        self._writing: BackgroundCall | None = None
        self._pause = QTimer(self, singleShot=True, interval=PAUSE_MS)
        self._pause.timeout.connect(self._write)

    def keep(self, fingerprint: str, transfer_function: TransferFunction) -> None:
        """Have a volume's TF written soon; returns at once."""
        if self._store is not None:
            self._unwritten[fingerprint] = transfer_function
            self._pause.start()

    def load(self, fingerprint: str) -> TransferFunction | None:
        """Return a volume's TF, None when there is none, or none that can be read."""
        if fingerprint in self._unwritten:
            return self._unwritten[fingerprint]
        if self._writing is not None and fingerprint in self._being_written:
            return self._being_written[fingerprint]
        if self._store is None:
            return None
        try:
            return self._store.load(fingerprint)
        except TransferFunctionError as error:
            if self._store.path(fingerprint).exists():
                # It could not even be set aside, and must not be overwritten.
                self._store = None
            self.problem.emit(str(error))
            return None

    def finish(self) -> None:
        """Write what is not written yet, and wait for it."""
        self._pause.stop()
        if self._writing is not None:
            self._writing.join()
        try:
            _save(self._store, self._taken())
        except Exception as error:
            self._fail(error_sentence(error))

    def _write(self) -> None:
        if self._writing is not None:
            # One write at a time, so that an older TF never replaces a newer one.
            self._pause.start()
            return
        self._being_written = self._taken()
        call = BackgroundCall(partial(_save, self._store, self._being_written), "keeper", self)
        call.failed.connect(self._fail)
        call.finished.connect(self._end_writing)
        self._writing = call
        call.start()

    def _taken(self) -> dict[str, TransferFunction]:
        taken, self._unwritten = self._unwritten, {}
        return taken

    def _end_writing(self) -> None:
        if self._writing is not None:
            self._writing.join()
            self._writing.deleteLater()
            self._writing = None

    def _fail(self, text: str) -> None:
        # Once: the same disk may fail for a thread and for the end of it all.
        if self._store is not None:
            self._store = None
            self.problem.emit(text)


def _save(store: TransferFunctionStore | None, tfs: dict[str, TransferFunction]) -> None:
    for fingerprint, transfer_function in tfs.items():
        if store is not None:
            store.save(fingerprint, transfer_function)
