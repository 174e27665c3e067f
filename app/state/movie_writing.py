"""A movie that is written while its pictures are drawn."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from queue import SimpleQueue

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.state.latest_call import LatestCall
from model.rendering.movie_file import write_movie

Picture = NDArray[np.uint8]


class MovieWriting(QObject):
    """Writes one movie at a time in a thread, picture by picture.

    Parameters
    ----------
    name : str
        Name of the threads, for debuggers.
    """

    done = Signal(object)
    """Emitted with the path of a movie that is there."""
    failed = Signal(str)
    """Emitted with an error sentence; nothing of the movie is left."""

    def __init__(self, name: str, parent: QObject) -> None:
        super().__init__(parent)
        self._call = LatestCall(name, self)
        self._call.done.connect(self.done)
        self._call.failed.connect(self.failed)
        self._pictures: SimpleQueue[Picture | _End] = SimpleQueue()

    @property
    def is_running(self) -> bool:
        """True from the start of a movie until it is there, or given up."""
        return self._call.is_running

    def start(self, path: Path, rate: float) -> None:
        """Begin a movie of so many pictures a second; none must be under way."""
        assert not self.is_running
        self._pictures = SimpleQueue()
        self._call.ask(partial(write_movie, path, _until_the_end(self._pictures), rate))

    def add(self, picture: Picture) -> None:
        """Add the next picture, uint8 (H, W, 3)."""
        self._pictures.put(picture)

    def finish(self) -> None:
        """End the movie, which is then written."""
        self._pictures.put(_End(complete=True))

    def cancel(self) -> None:
        """Give the movie up."""
        if self.is_running:
            self._call.forget()
            self._pictures.put(_End(complete=False))

    def join(self) -> None:
        """Wait until the thread has ended, after :meth:`finish` or :meth:`cancel`."""
        self._call.join()


class _End:
    def __init__(self, complete: bool) -> None:
        self.complete = complete


class _GivenUpError(Exception):
    """Ends the writing of a movie that nobody wants."""


def _until_the_end(pictures: SimpleQueue[Picture | _End]) -> Iterator[Picture]:
    while not isinstance(picture := pictures.get(), _End):
        yield picture
    if not picture.complete:
        raise _GivenUpError
