"""How fast this machine would train a model: measured before anybody has to decide on it."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, QProcess, Signal

from app.state.training_order import TFSCOPE


class TrainingPace(QObject):
    """Has ``tfscope train --pace`` measure some steps, in a process of its own.

    Parameters
    ----------
    command : sequence of str
        Program and first arguments.
    """

    found = Signal(float, float)
    """Emitted with the samples a second, and the seconds that the preparations took."""

    def __init__(self, parent: QObject | None = None, command: Sequence[str] = TFSCOPE) -> None:
        super().__init__(parent)
        self._command = list(command)
        self._process: QProcess | None = None
        self._begun = self._prepared = 0.0

    @property
    def is_running(self) -> bool:
        """Whether something is being measured."""
        return self._process is not None

    def measure(self, order: Sequence[str]) -> None:
        """Measure the pace of a training, see :func:`~app.state.training_order.training_order`."""
        self.cancel()
        process = QProcess(self)
        process.setProgram(self._command[0])
        # Nothing is written there.
        out = Path(tempfile.gettempdir(), "tfscope-pace")
        process.setArguments([*self._command[1:], *order, "--pace", "--out", str(out)])
        process.readyReadStandardOutput.connect(self._read)
        self._process, self._begun = process, time.monotonic()
        process.start()

    def cancel(self) -> None:
        """End the measurement, if there is one."""
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            process.waitForFinished(-1)
            process.deleteLater()

    def _read(self) -> None:
        while self._process is not None and self._process.canReadLine():
            try:
                line = json.loads(bytes(self._process.readLine().data()))
            except ValueError:
                continue
            if isinstance(line, dict) and line.get("kind") == "execution":
                self._prepared = time.monotonic() - self._begun
            elif isinstance(line, dict) and line.get("kind") == "pace":
                self.found.emit(float(line["samples_per_second"]), self._prepared)
