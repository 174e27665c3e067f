"""Keeps edited TFs without making the window wait for the disk."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QObject, Signal

from app.state.delayed_writer import DelayedWriter
from app.state.transfer_function_store import TransferFunctionStore
from model.errors import TransferFunctionError
from model.scene.transfer_function import TransferFunction


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
        self._writer = DelayedWriter(self._take, "keeper", self)
        self._writer.problem.connect(self.problem)

    def keep(self, fingerprint: str, transfer_function: TransferFunction) -> None:
        """Have a volume's TF written soon; returns at once."""
        if self._store is not None and not self._writer.has_failed:
            self._unwritten[fingerprint] = transfer_function
            self._writer.note()

    def load(self, fingerprint: str) -> TransferFunction | None:
        """Return a volume's TF, None when there is none, or none that can be read."""
        if fingerprint in self._unwritten:
            return self._unwritten[fingerprint]
        if self._writer.is_writing and fingerprint in self._being_written:
            return self._being_written[fingerprint]
        if self._store is None or self._writer.has_failed:
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
        self._writer.finish()

    def _take(self) -> Callable[[], None]:
        self._being_written, self._unwritten = self._unwritten, {}
        return partial(_save, self._store, self._being_written)


def _save(store: TransferFunctionStore | None, tfs: dict[str, TransferFunction]) -> None:
    for fingerprint, transfer_function in tfs.items():
        if store is not None:
            store.save(fingerprint, transfer_function)
