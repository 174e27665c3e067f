"""Stopping a run by Ctrl-C between two steps, and one run at a time in a folder.

An interrupted step cannot be resumed exactly, as the discriminator may have been
updated already but not the generator.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from filelock import FileLock, Timeout

from model.errors import TrainingError, reason

LOCK_FILE = "training.lock"


@contextmanager
def training_in(folder: Path) -> Iterator[None]:
    """Keep other processes from training in a folder.

    Raises
    ------
    TrainingError
        When another run is there, or the folder cannot be written.
    """
    lock = FileLock(folder / LOCK_FILE, timeout=0)
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
        yield
    finally:
        lock.release()


def unwritable(folder: Path, error: OSError) -> TrainingError:
    """Return the error for a run's folder that cannot be written."""
    return TrainingError(
        f"{folder}: the run cannot be written ({reason(error)}); "
        "make room or choose another folder."
    )


class Interruption:
    """Context manager that records the first Ctrl-C instead of raising.

    A second Ctrl-C raises :class:`KeyboardInterrupt` at once. Outside the main
    thread, or if SIGINT has another handler, it does nothing.

    Attributes
    ----------
    asked : bool
        Whether Ctrl-C has been pressed.
    """

    def __init__(self) -> None:
        self.asked = False
        self._installed = False

    def __enter__(self) -> Interruption:
        main = threading.current_thread() is threading.main_thread()
        if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._note)
            self._installed = True
        return self

    def __exit__(self, *error: object) -> None:
        self._release()

    def _note(self, number: int, frame: FrameType | None) -> None:
        self.asked = True
        self._release()

    def _release(self) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            self._installed = False
