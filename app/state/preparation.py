"""Compilation of the renderers' kernels for this computer, once, in processes beside the window."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, QProcess, QTimer, Signal

from model.kernel_cache import KernelGroup, keeps_kernels

COMMAND = (sys.executable, "-m", "app.prepare_kernels")
ROOT = Path(__file__).resolve().parents[2]

PROCESSES = 2
"""Processes at a time: each takes a processor and half a gigabyte."""

LONGEST_S = 300
"""Time after which a process hangs; the busiest machine seen took a third of it."""


class Preparation(QObject):
    """Compiles groups of kernels that are wanted, in their order.

    A group that cannot be compiled beside the window counts as prepared: an engine compiles it
    when it first draws. So does each where nothing can be kept.

    Parameters
    ----------
    command : sequence of str
        Compiles the group whose type of voxels, lighting and purpose follow.
    longest_s : float
        Seconds after which a process is ended.
    """

    prepared = Signal()
    """Emitted when an engine may use the kernels of one more group."""
    progressed = Signal(int, int)
    """Emitted with how many of the wanted groups are prepared, and how many are wanted."""

    def __init__(
        self,
        parent: QObject | None = None,
        command: Sequence[str] = COMMAND,
        longest_s: float = LONGEST_S,
    ) -> None:
        super().__init__(parent)
        self._command, self._longest_s = tuple(command), longest_s
        self._is_kept = keeps_kernels()
        self._usable: set[KernelGroup] = set()
        self._wanted: tuple[KernelGroup, ...] = ()
        self._running: dict[KernelGroup, QProcess] = {}

    def is_prepared(self, group: KernelGroup) -> bool:
        """Return whether an engine may use a group's kernels."""
        # Asked at each change of the scene: what is there once needs no look at the disk again.
        if group not in self._usable and (not self._is_kept or group.is_prepared):
            self._usable.add(group)
        return group in self._usable

    def want(self, groups: Sequence[KernelGroup]) -> None:
        """Prepare these groups next; what is under way goes on."""
        if tuple(groups) != self._wanted:
            self._wanted = tuple(groups)
            self._go_on()
            self._tell()

    def stop(self) -> None:
        """End all processes; what they have compiled is kept."""
        self._wanted = ()
        for process in self._running.values():
            process.finished.disconnect()
            process.errorOccurred.disconnect()
            process.kill()
            process.waitForFinished()
        self._running.clear()

    def _go_on(self) -> None:
        for group in self._wanted:
            if len(self._running) >= PROCESSES:
                return
            if group not in self._running and not self.is_prepared(group):
                self._start(group)

    def _start(self, group: KernelGroup) -> None:
        process = QProcess(self)
        process.setWorkingDirectory(str(ROOT))
        process.setStandardOutputFile(QProcess.nullDevice())
        process.setStandardErrorFile(QProcess.nullDevice())
        hanging = QTimer(process, singleShot=True, interval=round(1000 * self._longest_s))
        hanging.timeout.connect(process.kill)
        process.finished.connect(self._take_end)
        process.errorOccurred.connect(self._take_error)
        self._running[group] = process
        name, *arguments = self._command
        process.start(name, [*arguments, group.voxels, group.lighting, group.purpose])
        hanging.start()

    def _take_error(self, error: QProcess.ProcessError) -> None:
        # All others are followed by an end.
        if error is QProcess.ProcessError.FailedToStart:
            self._take_end()

    def _take_end(self) -> None:
        process = self.sender()
        group = next(g for g, running in self._running.items() if running is process)
        self._running.pop(group).deleteLater()
        self._usable.add(group)
        self._go_on()
        self._tell()
        self.prepared.emit()

    def _tell(self) -> None:
        done = sum(map(self.is_prepared, self._wanted))
        self.progressed.emit(done, len(self._wanted))
