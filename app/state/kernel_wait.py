"""Text of the reference's pane while nothing can draw before the first kernel is compiled."""

from __future__ import annotations

from time import monotonic

from PySide6.QtCore import QObject, QTimer

from app.engines.client import EngineClient

USUAL_S = 15
"""Time that the first kernels take on two processors of a usual computer."""

TICK_MS = 1000


class KernelWait(QObject):
    """Counts the seconds in the pane of the reference."""

    def __init__(self, reference: EngineClient) -> None:
        super().__init__(reference)
        self._reference = reference
        self._problem, self._began = "", 0.0
        self._tick = QTimer(self, interval=TICK_MS)
        self._tick.timeout.connect(self._tell)

    def begin(self, problem: str) -> None:
        """Say why nothing else draws, and how long it has taken so far."""
        self._problem = problem
        if not self._tick.isActive():
            self._began = monotonic()
            self._tick.start()
        self._tell()

    def end(self) -> None:
        """Say nothing any more: something draws."""
        self._tick.stop()

    def _tell(self) -> None:
        self._reference.wait(
            f"{self._problem.rstrip('.')}. The ray caster draws the first image. Its code is being "
            f"compiled, once per computer: {monotonic() - self._began:.0f} of about {USUAL_S} s …"
        )
