"""``train``: training of a generator, with progress display."""

from __future__ import annotations

import json
import shlex
import sys
import time
from contextlib import suppress
from dataclasses import asdict, replace

from rich.console import Group
from rich.live import Live
from rich.progress import (
    BarColumn,
    Progress,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from app.cli.console import console
from model.errors import TfscopeError, VolumeError
from model.networks.recorded_errors import worth_of
from model.training import parallel
from model.training.execution import Execution
from model.training.job import TrainingJob
from model.training.plan import TrainingReport
from model.training.running import run_job
from model.training.state import STATE_FILE

LINE_SECONDS = 0.5
"""Least time between lines of machine-readable progress."""

TIMED_SAMPLES = 1000
"""Samples of the run whose time is estimated to tell the pace."""

LONG_RUN = 20_000
"""Samples from which on a run's time is estimated before it begins."""


def train_model(job: TrainingJob, lines: bool) -> None:
    """Train with a progress bar or JSON lines; Ctrl-C saves and ends the run."""
    try:
        if parallel.rank_to_be():
            run_job(job)
        elif lines:
            _run_with_lines(job)
        else:
            _run_with_bar(job)
    except KeyboardInterrupt:
        if not parallel.rank_to_be() and not lines:
            _say_how_to_go_on(job)
        raise
    if lines or parallel.rank_to_be():
        return
    console.print(worth_of(job.out))
    volume = [] if job.volume.path is None else ["--volume", str(job.volume.path)]
    window = shlex.join(["python", "main.py", "--model", str(job.out), *volume])
    console.print(f"The model is in {job.out}; open it with: {window}")


def measure_pace(job: TrainingJob, lines: bool) -> None:
    """Tell from how many samples a second a job would learn here; takes some seconds.

    Parameters
    ----------
    lines : bool
        As two JSON objects, "execution" and "pace"; else as a sentence.
    """
    from model.devices import choose_device
    from model.training.run_forecast import forecast_run
    from model.training.running import shared_execution

    volume, device = job.volume.read(), choose_device(job.device)
    execution = shared_execution(job, job.scene_of(volume), device)
    if lines:
        _write("execution", **asdict(execution))
    timed = replace(job, minutes=None, samples=TIMED_SAMPLES)
    pace = TIMED_SAMPLES / forecast_run(timed, volume, device, execution)
    if lines:
        _write("pace", samples_per_second=pace)
    else:
        console.print(f"This machine would learn from {pace:.3g} samples a second.")


def _write(kind: str, **data: object) -> None:
    """Print a JSON object in a line."""
    print(json.dumps({"kind": kind, **data}, allow_nan=False), flush=True)


def _run_with_bar(job: TrainingJob) -> None:
    def say(execution: Execution) -> None:
        console.print(f"Steps are computed in {execution}: the fastest way measured here.")
        _say_how_long(job, execution)

    _say_how_long(job, None)
    with TrainingDisplay() as display:
        run_job(job, display.show, say)


def _is_long(job: TrainingJob) -> bool:
    return job.samples is not None and job.samples >= LONG_RUN


def _say_how_long(job: TrainingJob, execution: Execution | None) -> None:
    """Say what a long run by samples will take, roughly while its execution is not chosen yet."""
    if not _is_long(job):
        return
    from app.cli.console import about
    from model.devices import choose_device
    from model.training.execution import STANDARD
    from model.training.run_forecast import forecast_run

    try:
        volume = job.volume.read()
    except VolumeError:
        return
    rough = execution is None
    device = choose_device(job.device)
    seconds = forecast_run(job, volume, device, execution or STANDARD, rough)
    time_here = f"This run of {job.samples:,} samples takes {about(seconds)} on this machine"
    if rough:
        # Steps of large networks take seconds, and some of each way are timed.
        console.print(
            f"{time_here}, by one step of each stage. How steps are computed fastest is measured "
            "now, which may take minutes, and then the time again."
        )
    else:
        console.print(
            f"{time_here}. It can be stopped and go on at any time; "
            "--minutes or --epochs make it shorter."
        )


def _run_with_lines(job: TrainingJob) -> None:
    """Print a JSON object per line: "execution", then "progress", at last "end"."""
    last = 0.0

    def report(found: TrainingReport) -> None:
        nonlocal last
        if found.notice or found.spent >= 1 or time.monotonic() - last > LINE_SECONDS:
            last = time.monotonic()
            try:
                _write("progress", **asdict(found))
            except BrokenPipeError:
                # Whoever reads has gone: save and end, as after Ctrl-C.
                raise KeyboardInterrupt from None

    try:
        run_job(job, report, lambda execution: _write("execution", **asdict(execution)))
    except KeyboardInterrupt:
        with suppress(BrokenPipeError):
            _write("end", how="stopped", saved=(job.out / STATE_FILE).exists())
        raise
    except TfscopeError as error:
        with suppress(BrokenPipeError):
            _write("end", how="failed", error=str(error))
        raise
    _write("end", how="finished", model=str(job.out), verdict=worth_of(job.out))


def _say_how_to_go_on(job: TrainingJob) -> None:
    if not (job.out / STATE_FILE).exists():
        console.print("Stopped before there was anything to save.")
        return
    again = shlex.join([*(a for a in sys.argv[1:] if a != "--resume"), "--resume"])
    console.print(f"Stopped; the run is saved. Go on with: python main.py {again}")


class TrainingDisplay:
    """Progress bar over the budget with speed and remaining time, and the losses below it."""

    def __init__(self) -> None:
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=20),
            TaskProgressColumn(),
            TextColumn("{task.fields[speed]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("left"),
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
            # Into a file, rich leaves the cursor behind the last numbers.
            console.print()

    def begin(self, name: str) -> None:
        """Print the name of the next of several runs, and reset speed and metrics."""
        self._live.console.print(name)
        self._first, self._metrics = None, {}

    def show(self, report: TrainingReport) -> None:
        """Show a report; a line stays for each new hold-out measurement."""
        # Not before the first step: what cannot start is told without a bar.
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
