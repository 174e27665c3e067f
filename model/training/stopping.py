"""Stopping a run between two steps, by Ctrl-C or by a file in its folder.

An interrupted step cannot be resumed exactly, as the discriminator may have been
updated already but not the generator. Signals differ between systems and reach
neither other machines nor processes without a terminal; a file works for all.
"""

from __future__ import annotations

import signal
import threading
from contextlib import suppress
from pathlib import Path
from types import FrameType

from model.errors import TrainingError

STOP_FILE = "training.stop"
LOCK_FILE = "training.lock"
"""Of whoever trains in a folder."""


def ask_to_stop(folder: Path) -> None:
    """Ask the run in a folder, in any process, to save its state and end.

    Raises
    ------
    TrainingError
        When nobody has trained in the folder, or the wish cannot be written there.
    """
    if not (folder / LOCK_FILE).exists():
        raise TrainingError(f"{folder}: no run is to be stopped there; give the run's folder.")
    try:
        (folder / STOP_FILE).touch()
    except OSError as error:
        raise TrainingError(
            f"{folder}: the run cannot be asked to stop ({error.strerror})."
        ) from error


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
        self._path = folder / STOP_FILE
        self._pressed = False
        self._installed = False

    @property
    def asked(self) -> bool:
        """True once Ctrl-C has been pressed or the stop file exists."""
        return self._pressed or self._path.exists()

    def __enter__(self) -> Interruption:
        self._forget()
        main = threading.current_thread() is threading.main_thread()
        if main and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, self._note)
            self._installed = True
        return self

    def __exit__(self, *error: object) -> None:
        self._release()
        self._forget()

    def _note(self, number: int, frame: FrameType | None) -> None:
        self._pressed = True
        self._release()

    def _release(self) -> None:
        if self._installed:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            self._installed = False

    def _forget(self) -> None:
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
