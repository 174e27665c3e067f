"""Stopping a run between two steps, by Ctrl-C or by a file in its folder.

An interrupted step cannot be resumed exactly, as the discriminator may have been
updated already but not the generator. Signals differ between systems and reach
neither other machines nor processes without a terminal; a file works for all.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType

from filelock import FileLock, Timeout

from model.errors import TrainingError, reason

STOP_FILE = "training.stop"
LOCK_FILE = "training.lock"


@contextmanager
def training_in(folder: Path) -> Iterator[None]:
    """Keep other processes from training in a folder, and forget earlier wishes to stop.

    Raises
    ------
    TrainingError
        When another run is there, or the folder cannot be written.
    """
    lock = _lock(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        raise TrainingError(
            f"{folder}: another process is training there; wait for it, stop it, "
            "or choose another folder."
        ) from None
    except OSError as error:
        raise unwritable(folder, error) from error
    try:
        _forget(folder)
        yield
    finally:
        lock.release()


def unwritable(folder: Path, error: OSError) -> TrainingError:
    """Return the error for a run's folder that cannot be written."""
    return TrainingError(
        f"{folder}: the run cannot be written ({reason(error)}); "
        "make room or choose another folder."
    )


def ask_to_stop(folder: Path) -> None:
    """Ask the run in a folder to save and end, from another process.

    Raises
    ------
    TrainingError
        When nobody is training in the folder, or the wish cannot be written there.
    """
    if not (folder / LOCK_FILE).exists() or _is_free(folder):
        raise TrainingError(f"{folder}: nobody is training there; give the run's folder.")
    try:
        (folder / STOP_FILE).touch()
    except OSError as error:
        raise TrainingError(
            f"{folder}: the run cannot be asked to stop ({reason(error)})."
        ) from error


def _lock(folder: Path) -> FileLock:
    return FileLock(folder / LOCK_FILE, timeout=0)


def _is_free(folder: Path) -> bool:
    """Return whether nobody holds the folder's lock; the file stays when a run ends."""
    lock = _lock(folder)
    try:
        lock.acquire()
    except Timeout:
        return False
    except OSError:
        return True
    lock.release()
    return True


def _forget(folder: Path) -> None:
    """Remove a wish to stop."""
    with suppress(OSError):
        (folder / STOP_FILE).unlink(missing_ok=True)


class Interruption:
    """Context manager that records the first Ctrl-C, or a stop file, instead of raising.

    A second Ctrl-C raises :class:`KeyboardInterrupt` at once. Outside the main
    thread, or if SIGINT has another handler, only the file is checked.

    Parameters
    ----------
    folder : Path
        Folder of the run. Its stop file is removed on entry and on exit.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._pressed = False
        self._installed = False

    @property
    def asked(self) -> bool:
        """True once Ctrl-C has been pressed or the stop file exists."""
        return self._pressed or (self._folder / STOP_FILE).exists()

    def __enter__(self) -> Interruption:
        main = threading.current_thread() is threading.main_thread()
        if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._note)
            self._installed = True
        return self

    def __exit__(self, *error: object) -> None:
        self._release()
        _forget(self._folder)

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._pressed = True
        self._release()

    def _release(self) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            self._installed = False
