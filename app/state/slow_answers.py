"""Slow answers and their progress."""

from collections.abc import Iterable

from PySide6.QtCore import QObject, Signal

from app.engines.background import Pause
from app.engines.client import Channel

PATIENCE_MS = 500  # after which the window says that an answer is under way


class SlowAnswers(QObject):
    """Watches the channels of one part of the window."""

    changed = Signal(object)
    """Emitted with a slow answer's progress, 0 to 1; None when no slow answer is left."""

    def __init__(self, channels: Iterable[Channel], parent: QObject) -> None:
        super().__init__(parent)
        self._channels = tuple(channels)
        self._part: float | None = None
        self._patience = Pause(self, PATIENCE_MS, lambda: self._say(0.0))
        for channel in self._channels:
            channel.pendingChanged.connect(self._follow)
            channel.progressed.connect(self._note)

    def _follow(self) -> None:
        if not any(channel.is_pending for channel in self._channels):
            self._patience.stop()
            self._say(None)
        elif self._part is None and not self._patience.isActive():
            self._patience.start()

    def _note(self, part: float) -> None:
        if self._part is not None:
            self._say(part)

    def _say(self, part: float | None) -> None:
        if part != self._part:
            self._part = part
            self.changed.emit(part)
