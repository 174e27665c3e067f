"""Every volume's TF, kept between runs without making the window wait for the disk."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from itertools import chain, count
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from app.state.delayed_writer import DelayedWriter
from app.state.user_folder import user_folder
from model.errors import TransferFunctionError, reason
from model.scene.transfer_function import TransferFunction


class TransferFunctionStore:
    """A folder with one TF file per volume.

    Parameters
    ----------
    folder : Path
        Created by the first save.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @classmethod
    def of_user(cls) -> TransferFunctionStore:
        """Return the store in the user's application data folder."""
        return cls(user_folder() / "transfer_functions")

    def path(self, fingerprint: str) -> Path:
        """Return the path of a volume's TF file."""
        return self._folder / f"{fingerprint[:32]}.json"

    def save(self, fingerprint: str, transfer_function: TransferFunction) -> None:
        """Save a volume's TF.

        Raises
        ------
        TransferFunctionError
            When it cannot be written.
        """
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise TransferFunctionError(
                f"{self._folder}: the folder cannot be made ({reason(error)}); "
                "transfer functions are not kept between runs."
            ) from error
        transfer_function.save(self.path(fingerprint))

    def load(self, fingerprint: str) -> TransferFunction | None:
        """Return a volume's TF, or None if there is none.

        Raises
        ------
        TransferFunctionError
            When the file is invalid, and has been renamed. A file that cannot be read
            or renamed stays in place, and a later save would overwrite it.
        """
        path = self.path(fingerprint)
        if not path.exists():
            return None
        try:
            return TransferFunction.load(path)
        except TransferFunctionError as error:
            if not isinstance(error.__cause__, OSError):
                with suppress(OSError):
                    path.replace(_free(path.with_suffix(".damaged")))
            raise


def _free(path: Path) -> Path:
    """Return an unused path similar to the given one."""
    names = chain([path], (path.with_suffix(f".{i}{path.suffix}") for i in count(2)))
    return next(name for name in names if not name.exists())


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
