"""Training of a generator by ``train``, with a progress display."""

from __future__ import annotations

import shlex
import sys

from rich.console import Group
from rich.live import Live
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn
from rich.text import Text

from app.cli.console import LEFT_COLUMNS, console
from model.networks.card import recorded_errors
from model.training import parallel
from model.training.options import TrainingJob
from model.training.plan import TrainingReport
from model.training.state import STATE_FILE
from model.training.trainer import run_job


def train_model(job: TrainingJob) -> None:
    """Train with a progress bar; Ctrl-C saves and ends the run."""
    if parallel.rank_to_be():
        run_job(job)
        return
    try:
        with TrainingDisplay() as display:
            run_job(job, display.show)
    except KeyboardInterrupt:
        if (job.out / STATE_FILE).exists():
            again = shlex.join([*(a for a in sys.argv[1:] if a != "--resume"), "--resume"])
            console.print(f"Stopped; the run is saved. Go on with: python main.py {again}")
        else:
            console.print("Stopped before there was anything to save.")
        raise
    console.print(recorded_errors(job.out))
    volume = [] if job.volume.path is None else ["--volume", str(job.volume.path)]
    window = shlex.join(["python", "main.py", "--model", str(job.out), *volume])
    console.print(f"The model is in {job.out}; open it with: {window}")


class TrainingDisplay:
    """Progress bar over the budget with speed and remaining time, and the losses below it."""

    def __init__(self) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            TaskProgressColumn(),
            TextColumn("{task.fields[speed]}"),
            *LEFT_COLUMNS,
        )
        self._losses = Text()
        self._live = Live(Group(self._progress, self._losses), console=console)
        self._task = self._progress.add_task("starting", total=1.0, speed="")
        self._first: TrainingReport | None = None
        self._metrics: dict[str, float] = {}

    def __enter__(self) -> TrainingDisplay:
        return self

    def __exit__(self, *exception: object) -> None:
        started = self._live.is_started
        self._live.stop()
        if started and not console.is_terminal:
            # In a file, rich would leave the cursor behind the last numbers.
            console.print()

    def begin(self, name: str) -> None:
        """Print the name of the next of several runs, and reset speed and metrics."""
        self._live.console.print(name)
        self._first, self._metrics = None, {}

    def show(self, report: TrainingReport) -> None:
        """Show a report, and print a line for each new hold-out measurement."""
        # Not before the first step: a run that cannot start shows no bar.
        self._live.start()
        first = self._first = self._first or report
        seconds = max(report.seconds - first.seconds, 1e-3)
        speed = (report.samples - first.samples) / seconds
        self._progress.update(
            self._task,
            description=f"stage {report.stage}",
            completed=report.spent,
            speed=f"{speed:.0f} samples/s",
        )
        if report.notice:
            self._live.console.print(report.notice)
        self._losses.plain = _numbers(report.losses)
        if report.metrics and report.metrics != self._metrics:
            self._metrics = report.metrics
            self._live.console.print(
                f"{report.seconds / 60:6.1f} min {report.samples:>9,} samples  "
                f"hold-out {_numbers(report.metrics)}"
            )


def _numbers(values: dict[str, float]) -> str:
    return "  ".join(f"{name} {value:.3f}" for name, value in values.items())
