"""Refreshes of plots and labels: at once at rest, a few times a second while something moves."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer

INTERVAL_S = 0.1
"""Shortest time between two refreshes while something moves: painting a plot takes long."""


class Calm(QObject):
    """Refreshes together all that asks for it, so that what they share is painted once."""

    def __init__(self, moves: Callable[[], bool], parent: QObject) -> None:
        super().__init__(parent)
        self._moves = moves
        self._waiting: dict[Callable[..., object], Callable[..., object]] = {}
        self._refreshed = -INTERVAL_S
        self._timer = QTimer(self, singleShot=True)
        self._timer.timeout.connect(self.catch_up)

    def soon(self, refresh: Callable[[], object]) -> Callable[..., None]:
        """Return a slot for signals that leads to a refresh."""
        return lambda *_: self.ask(refresh, refresh)

    def ask(self, name: Callable[..., object], refresh: Callable[[], object]) -> None:
        """Ask for a refresh, in place of one of the same name that is still waiting."""
        self._waiting[name] = refresh
        if not self._moves():
            self.catch_up()
        elif not self._timer.isActive():
            passed = time.monotonic() - self._refreshed
            self._timer.start(max(round(1000 * (INTERVAL_S - passed)), 0))

    def catch_up(self) -> None:
        """Refresh all that waits, as nothing moves any more."""
        waiting, self._waiting = self._waiting, {}
        self._timer.stop()
        self._refreshed = time.monotonic()
        for refresh in waiting.values():
            refresh()
