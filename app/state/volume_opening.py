"""Reading of volumes, and showing them over other scalar ranges, in the background."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any

from PySide6.QtCore import QObject, Signal

from app.engines.background import BackgroundCall
from app.state.opened_volume import OpenedVolume, open_volume
from model.errors import VolumeError
from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale
from model.scene.volume import Volume
from model.volume_files.choice import Choice
from model.volume_files.progress import Listener, ReadingCancelledError, watched
from model.volume_files.raw import RawLayout

TOLD_SECONDS = 0.2
"""Time between two reports of progress."""

Taker = Callable[[OpenedVolume], object]
Refusal = Callable[[str], object]


class VolumeOpening(QObject):
    """Reads one volume at a time in a thread; a newer wish replaces an older one.

    Parameters
    ----------
    read_volume : callable
        Reads a volume of a path, and of a raw file's layout where there is one.
    """

    progressed = Signal(str, int, int)
    """Emitted with what is done of the volume that is read, how many of it are, of how many."""

    def __init__(self, read_volume: Callable[..., Volume], parent: QObject) -> None:
        super().__init__(parent)
        self._read_volume = read_volume
        self._newest: BackgroundCall | None = None
        self._calls: list[BackgroundCall] = []
        self._stop = threading.Event()

    @property
    def is_busy(self) -> bool:
        """True while something is read or computed that is still wanted."""
        return self._newest is not None

    def read(
        self,
        path: Path,
        raw: RawLayout | None,
        taken: Taker,
        failed: Refusal,
        choice: Choice | None = None,
        is_remembered: bool = False,
    ) -> None:
        """Read a volume over its robust range.

        Parameters
        ----------
        raw : RawLayout or None
            Of a file without a header.
        taken, failed : callable
            Called with the volume, or with an error sentence; neither if a newer wish came.
        choice : Choice or None
            What to read where there are several volumes; None for the largest.
        is_remembered : bool
            Whether the choice is an old one, which gives way where the file no longer has it.
        """
        options = {"raw": raw, "choice": choice}
        given = {name: option for name, option in options.items() if option is not None}
        read = partial(self._read_volume, **given) if given else self._read_volume
        if choice is not None and is_remembered:
            read = partial(_read_if_there, read, partial(read, choice=None))
        stop = threading.Event()
        opening = partial(_watched_opening, path, read, self._teller(stop))
        self._start(opening, taken, failed, stop)

    def show_over(
        self,
        opened: OpenedVolume,
        scalar_range: Range,
        scale: ValueScale,
        taken: Taker,
        failed: Refusal,
    ) -> None:
        """Compute what an opened volume is over another range and scale; as :meth:`read`."""
        self._start(partial(opened.over, scalar_range, scale), taken, failed)

    def show_on_scale(
        self, opened: OpenedVolume, scale: ValueScale, taken: Taker, failed: Refusal
    ) -> None:
        """Compute what an opened volume is on another scale; as :meth:`read`."""
        self._start(partial(opened.on_scale, scale), taken, failed)

    def draw_missing(
        self, opened: OpenedVolume, drawn: bool, taken: Taker, failed: Refusal
    ) -> None:
        """Compute what an opened volume is with missing voxels drawn or not; as :meth:`read`."""
        self._start(partial(opened.drawing_missing, drawn), taken, failed)

    def _teller(self, stop: threading.Event) -> Listener:
        """Return what tells the progress from the thread, at times, and ends it on demand."""
        last = 0.0

        def tell(what: str, done: int, count: int) -> None:
            nonlocal last
            if stop.is_set():
                raise ReadingCancelledError("The reading was cancelled.")
            if monotonic() - last > TOLD_SECONDS:
                last = monotonic()
                self.progressed.emit(what, done, count)

        return tell

    def abandon(self) -> None:
        """Discard what is on its way."""
        self._stop.set()
        if self._newest is not None:
            self._newest.abandon()
            self._newest = None

    def join(self) -> None:
        """Wait until all threads have ended."""
        for call in self._calls:
            call.join()
            call.deleteLater()
        self._calls.clear()

    def _start(
        self,
        function: Callable[[], OpenedVolume],
        taken: Taker,
        failed: Refusal,
        stop: threading.Event | None = None,
    ) -> None:
        self.abandon()
        self._stop = stop or threading.Event()
        call = BackgroundCall(function, "volume")
        call.done.connect(partial(self._finish, taken))
        call.failed.connect(partial(self._finish, failed))
        call.finished.connect(self._forget_call)
        self._newest = call
        self._calls.append(call)
        call.start()

    def _finish(self, take: Callable[[Any], object], outcome: object) -> None:
        # Whoever takes it may start the next one.
        self._newest = None
        take(outcome)

    def _forget_call(self) -> None:
        call = self.sender()
        if isinstance(call, BackgroundCall) and call in self._calls:
            self._calls.remove(call)
            call.join()
            call.deleteLater()


def _watched_opening(
    path: Path, read: Callable[[Path], Volume], listener: Listener
) -> OpenedVolume:
    with watched(listener):
        return open_volume(path, read)


def _read_if_there(
    chosen: Callable[[Path], Volume], largest: Callable[[Path], Volume], path: Path
) -> Volume:
    """Read what was chosen before, or the largest volume if that is no longer there."""
    try:
        return chosen(path)
    except ReadingCancelledError:
        raise
    except VolumeError:
        return largest(path)
