"""Compilation of the renderers' kernels for this computer, once, in other processes."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from time import monotonic

from PySide6.QtCore import QObject, QProcess, QTimer, Signal

from app.engines.background import Pause
from model.kernel_cache import KernelGroup, keeps_kernels
from model.measurements import processors

COMMAND = (sys.executable, "-m", "app.prepare_kernels")
ROOT = Path(__file__).resolve().parents[2]

PROCESSES = 2  # processes at a time; each needs a processor and half a gigabyte
LONGEST_S = 300  # longest time of a group: three times the slowest measured
PATIENCE_MS = 5000  # longest wait for the first picture before compiling

USUAL_S, TICK_MS = 18, 1000
"""Time of a group on a typical idle computer with two processors, and time between reports of the
rest."""


class Preparation(QObject):
    """Compiles the wanted groups of kernels in order, once the first picture is drawn.

    The command reads the names of groups, one per line, and writes each name back. If that fails,
    or takes more than `longest_s`, an engine compiles the group when it first draws.
    """

    prepared = Signal()  # emitted when an engine may use the kernels of one more group
    progressed = Signal(int, int, str)
    """Emitted with the numbers of prepared and wanted groups, and the remaining time in words, each
    second until all are prepared."""

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
        self._workers: list[_Worker] = []
        self._has_begun = False
        # When the present groups were wanted, and how many of them were prepared by then.
        self._since, self._before, self._crowd = 0.0, 0, 1.0
        self._least = 0  # least remaining time that was said, in seconds
        self.text = ""  # sentence with the remaining time; empty once all are prepared
        self._tick = QTimer(self, interval=TICK_MS)
        self._tick.timeout.connect(self._say_progress)
        self._patience = Pause(self, PATIENCE_MS, self.begin)

    def is_prepared(self, group: KernelGroup) -> bool:
        """Return whether an engine may use a group's kernels."""
        # Asked at each change of the scene, so results are cached.
        if group not in self._usable and (not self._is_kept or group.is_prepared):
            self._usable.add(group)
        return group in self._usable

    def want(self, groups: Sequence[KernelGroup]) -> None:
        """Prepare these groups next; running compilations go on."""
        if tuple(groups) != self._wanted:
            self._wanted = tuple(groups)
            self._since, self._before = monotonic(), sum(map(self.is_prepared, groups))
            self._crowd, self._least = _crowd(), LONGEST_S * len(groups)
            self._tick.start()
            if not self._has_begun:
                self._patience.start()
            self._go_on()
            self._say_progress()

    def begin(self) -> None:
        """Begin compiling: the first picture, which needed the processors, is drawn."""
        if not self._has_begun:
            self._has_begun = True
            self._patience.stop()
            self._go_on()

    def stop(self) -> None:
        """End all processes; compiled kernels stay."""
        self._patience.stop()
        self._tick.stop()
        self._wanted = ()
        self._workers.clear()
        for worker in self.findChildren(_Worker):
            worker.blockSignals(True)
            worker.kill()
            worker.waitForFinished()

    def _go_on(self) -> None:
        """Give each worker a group, start missing workers, and end idle ones."""
        if not self._has_begun:
            return
        under_way = {worker.group for worker in self._workers}
        todo = [g for g in self._wanted if g not in under_way and not self.is_prepared(g)]
        idle = [worker for worker in self._workers if worker.group is None]
        for group in todo:
            if idle:
                idle.pop(0).give(group)
            elif len(self._workers) < PROCESSES:
                self._start(group)
        for worker in idle:
            self._workers.remove(worker)
            worker.closeWriteChannel()

    def _start(self, group: KernelGroup) -> None:
        worker = _Worker(self._longest_s, self)
        worker.done.connect(self._take)
        worker.ended.connect(self._take_end)
        self._workers.append(worker)
        name, *arguments = self._command
        worker.start(name, arguments)
        worker.give(group)

    def _take(self, group: KernelGroup) -> None:
        """Note that a group is compiled, or can be compiled by an engine only."""
        self._usable.add(group)
        self._go_on()
        self._say_progress()
        self.prepared.emit()

    def _take_end(self, worker: _Worker) -> None:
        if worker in self._workers:
            self._workers.remove(worker)
        worker.deleteLater()
        if worker.group is not None:
            self._take(worker.group)

    def _text(self) -> str:
        """Say the remaining time of the wanted groups, which never rises."""
        done = sum(map(self.is_prepared, self._wanted)) - self._before
        count, spent = len(self._wanted) - self._before, monotonic() - self._since
        if done == count:
            return ""
        whole = max(count * USUAL_S / PROCESSES * self._crowd, 1.5 * spent)
        if done > 0:
            # Groups in progress count as half done.
            whole = spent * count / min(done + len(self._workers) / 2, count)
        self._least = min(5 * max(math.ceil((whole - spent) / 5), 1), self._least)
        return f"Compiling, about {self._least} s left …"

    def _say_progress(self) -> None:
        done = sum(map(self.is_prepared, self._wanted))
        if done == len(self._wanted):
            self._tick.stop()
        self.text = self._text()
        self.progressed.emit(done, len(self._wanted), self.text)


def _crowd() -> float:
    """Factor by which other programs slow down two processes, from the system's load."""
    others = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    return max((others + PROCESSES) / processors(), 1.0)


class _Worker(QProcess):
    """A process that compiles one group after the other; its group is None while it waits."""

    done = Signal(object)  # emitted with the group that is compiled
    ended = Signal(object)  # emitted with the worker when its process has ended or failed

    def __init__(self, longest_s: float, parent: QObject) -> None:
        super().__init__(parent)
        self.group: KernelGroup | None = None
        self.setWorkingDirectory(str(ROOT))
        self.setStandardErrorFile(QProcess.nullDevice())
        self._hanging = Pause(self, round(1000 * longest_s), self.kill)
        self.readyReadStandardOutput.connect(self._read)
        self.finished.connect(self._take_finished)
        self.errorOccurred.connect(self._take_error)

    def give(self, group: KernelGroup) -> None:
        """Have it compile a group."""
        self.group = group
        self.write(f"{group.name}\n".encode())
        self._hanging.start()

    def _read(self) -> None:
        while self.canReadLine():
            line = bytes(self.readLine().data()).decode().strip()
            if self.group is not None and line == self.group.name:
                group, self.group = self.group, None
                self._hanging.stop()
                self.done.emit(group)

    def _take_finished(self) -> None:
        self._hanging.stop()
        self.ended.emit(self)

    def _take_error(self, error: QProcess.ProcessError) -> None:
        # After other errors, the process also finishes.
        if error is QProcess.ProcessError.FailedToStart:
            self._take_finished()
