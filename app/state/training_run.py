"""A training that the window starts, in a process of its own."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Unpack

from PySide6.QtCore import QObject, QProcess, QTimer, Signal

from app.state.model_folders import new_model_folder, remove_if_unused
from app.state.training_clock import MINUTES, TrainingClock
from app.state.training_order import TFSCOPE, TrainingChoices, training_order
from model.errors import TrainingError
from model.scene.scene import Lighting
from model.training.stopping import ask_to_stop
from model.volume_files.finish import readable_name

PATIENCE_MS = 8_000
"""Time in which a run that is asked to stop saves itself; then it is killed."""

TICK_MS = 500
"""Time between two signals of progress while the run says nothing."""

NICENESS = 10
"""Priority of the run below the window's, where the system has priorities."""

TRAINED_LIGHT: dict[Lighting, Lighting] = {
    "none": "none",
    "direct": "direct",
    "soft": "direct",
    "shadows": "direct",
    "path": "direct",
}
"""Light that a model learns where the window shows one: a network would take hours to learn
shadows, as their images are not drawn by the thousand."""


class TrainingRun(QObject):
    """Runs ``tfscope train`` beside the window and tells how it goes; one run at a time.

    Parameters
    ----------
    command : sequence of str
        Program and first arguments.
    """

    progressed = Signal(float, str)
    """Emitted with the fraction of the time passed, and words on what is done and how long."""
    finished = Signal(object)
    """Emitted with the folder of a whole model; see :attr:`verdict`."""
    failed = Signal(str)
    """Emitted with an error sentence."""
    cancelled = Signal()
    """Emitted when a run has ended because it was asked to."""

    def __init__(self, parent: QObject | None = None, command: Sequence[str] = TFSCOPE) -> None:
        super().__init__(parent)
        self._command = list(command)
        self._process: QProcess | None = None
        self._folder = Path()
        self._saved: dict[tuple[str, ...], Path] = {}
        self._order: tuple[str, ...] = ()
        self._name = ""
        self._is_folder_new = self._is_cancelled = False
        self._verdict = ""
        self._forget_outcome(MINUTES)
        self._tick = QTimer(self, interval=TICK_MS)
        self._tick.timeout.connect(self._tell)
        self._patience = QTimer(self, singleShot=True, interval=PATIENCE_MS)
        self._patience.timeout.connect(self._kill)

    @property
    def is_running(self) -> bool:
        """True from the start of a run to its end."""
        return self._process is not None

    @property
    def volume_name(self) -> str:
        """Name of the volume of the present or last run, for display."""
        return self._name

    @property
    def unfinished(self) -> str:
        """Work that stopping it would lose, in words; empty for none."""
        return f"A model of '{self._name}' is being trained" if self.is_running else ""

    @property
    def verdict(self) -> str:
        """What the last model is worth; empty where that is not known."""
        return self._verdict

    def start(
        self,
        volume_path: Path,
        out: Path | None = None,
        minutes: float = MINUTES,
        **choices: Unpack[TrainingChoices],
    ) -> None:
        """Start to train a model of a volume's file; returns at once.

        A run of the same volume and options that was cancelled before goes on.

        Parameters
        ----------
        out : Path or None
            Folder of the model; None for a new one of :func:`new_model_folder`.
        choices : dict
            See :class:`~app.state.training_order.TrainingChoices`.
        """
        if self._process is not None:
            return
        order = training_order(volume_path, minutes, **choices)
        self._order, self._name = order, readable_name(volume_path)
        self._forget_outcome(minutes)
        goes_on = out is None and self._order in self._saved
        self._is_folder_new = out is None and not goes_on
        try:
            self._folder = self._saved.pop(self._order) if goes_on else self._new_folder(out)
        except TrainingError as error:
            self.failed.emit(str(error))
            return
        process = QProcess(self)
        process.setProgram(self._command[0])
        options = ["--out", str(self._folder), *(["--resume"] if goes_on else [])]
        process.setArguments([*self._command[1:], *order, *options])
        process.started.connect(self._give_way)
        process.readyReadStandardOutput.connect(self._read)
        process.readyReadStandardError.connect(self._read_complaint)
        process.finished.connect(self._end)
        process.errorOccurred.connect(self._cannot_start)
        self._process = process
        self._tell()
        self._tick.start()
        process.start()

    def cancel(self) -> None:
        """Ask the run to save itself and end, as Ctrl-C does; returns at once.

        Once the model is there and only measured, it is kept: the run is finished then.
        """
        if self._process is None or self._is_cancelled:
            return
        self._is_cancelled = True
        self._patience.start()
        with suppress(TrainingError):
            # Also where there are no signals, or the run was told to ignore them.
            ask_to_stop(self._folder)
        pid = self._process.processId()
        if sys.platform != "win32" and pid > 0:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGINT)

    def join(self) -> None:
        """Cancel the run and wait for its end: nothing is left behind."""
        self.cancel()
        if self._process is not None and not self._process.waitForFinished(PATIENCE_MS):
            self._kill()
            if self._process is not None:
                self._process.waitForFinished(-1)

    def _new_folder(self, out: Path | None) -> Path:
        return new_model_folder(self._name) if out is None else out.absolute()

    def _forget_outcome(self, minutes: float) -> None:
        self._clock = TrainingClock(minutes)
        self._end_line: dict[str, Any] = {}
        self._complaint = ""
        self._verdict = ""
        self._is_cancelled = False

    def _give_way(self) -> None:
        if self._process is not None and sys.platform != "win32":
            with suppress(OSError):
                os.setpriority(os.PRIO_PROCESS, self._process.processId(), NICENESS)

    def _tell(self) -> None:
        words = "stopping" if self._is_cancelled else self._clock.words
        self.progressed.emit(self._clock.fraction, words)

    def _read(self) -> None:
        while self._process is not None and self._process.canReadLine():
            try:
                line = json.loads(bytes(self._process.readLine().data()))
            except ValueError:
                continue
            if isinstance(line, dict):
                self._take(line)

    def _take(self, line: dict[str, Any]) -> None:
        kind = line.get("kind")
        if kind == "progress":
            self._clock.note_spent(float(line.get("spent", 0.0)))
            self._tell()
        elif kind == "measuring":
            self._clock.enter("measuring")
            self._tell()
        elif kind == "end":
            self._end_line = line

    def _read_complaint(self) -> None:
        if self._process is not None:
            said = bytes(self._process.readAllStandardError().data()).decode(errors="replace")
            self._complaint = (self._complaint + said)[-4000:]

    def _cannot_start(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.ProcessError.FailedToStart:
            self._forget_process()
            self._clear_folder()
            self.failed.emit(
                f"{self._command[0]}: the training cannot be started; install tfscope anew."
            )

    def _end(self, code: int, status: QProcess.ExitStatus) -> None:
        self._read()
        self._read_complaint()
        self._forget_process()
        how = self._end_line.get("how")
        if how == "finished" or self._clock.phase == "measuring":
            self._verdict = str(self._end_line.get("verdict", ""))
            self.finished.emit(self._folder)
            return
        self._clear_folder()
        if self._is_cancelled or how == "stopped":
            if self._end_line.get("saved"):
                self._saved[self._order] = self._folder
            self.cancelled.emit()
        else:
            self.failed.emit(self._reason(code, status))

    def _reason(self, code: int, status: QProcess.ExitStatus) -> str:
        """Return why a run has failed, in a sentence."""
        if "error" in self._end_line:
            return str(self._end_line["error"])
        lines = self._complaint.strip().splitlines()
        if status == QProcess.ExitStatus.CrashExit or not lines:
            return (
                f"The training of '{self._name}' was ended by the system (code {code}), perhaps "
                "for lack of memory; close other programs and try again."
            )
        told = lines[-1].removeprefix("tfscope: ").partition(" Try: --")[0]
        return f"The training of '{self._name}' failed: {told}"

    def _clear_folder(self) -> None:
        if self._is_folder_new:
            remove_if_unused(self._folder)

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()

    def _forget_process(self) -> None:
        self._tick.stop()
        self._patience.stop()
        if self._process is not None:
            self._process.deleteLater()
            self._process = None
