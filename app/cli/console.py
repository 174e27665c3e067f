"""Sentences, tables and progress bars in the terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich import progress
from rich.console import Console
from rich.table import Table
from rich.text import Text

from model.scene.volume import Volume

if TYPE_CHECKING:
    from model.samples.sample_store import SampleStore

WIDE = 200  # columns of a table that is printed to a file
LEFT_COLUMNS = (
    progress.TimeElapsedColumn(),
    progress.TimeRemainingColumn(),
    progress.TextColumn("left"),
)
console = Console(markup=False, highlight=False, soft_wrap=True)


def warn(message: str) -> None:
    """Print a sentence on standard error, so that standard output has the result alone."""
    print(f"tfscope: {message}", file=sys.stderr)


def warn_of(volume: Volume) -> None:
    """Print what the reader of a volume assumed or changed."""
    for note in volume.notes:
        warn(note)


def about(seconds: float) -> str:
    """Say a duration roughly, in words."""
    if seconds < 45:
        return "less than a minute"
    if seconds >= 2 * 86400:
        return f"about {seconds / 86400:.0f} days"
    if seconds >= 2 * 3600:
        return f"about {seconds / 3600:.0f} hours"
    minutes = max(round(seconds / 60), 1)
    return "about a minute" if minutes == 1 else f"about {minutes} minutes"


class _SpeedColumn(progress.ProgressColumn):
    """Column with the number of items per second."""

    def render(self, task: progress.Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text("" if speed is None else f"{speed:.1f}/s")


@contextmanager
def bars() -> Iterator[Callable[[str, int, int], None]]:
    """Show progress bars with count, speed and time left; yield a function that updates one."""
    columns = (
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        _SpeedColumn(),
        *LEFT_COLUMNS,
    )
    with progress.Progress(*columns, console=console, speed_estimate_period=60) as shown:
        tasks: dict[str, progress.TaskID] = {}

        def show(name: str, done: int, total: int) -> None:
            if name not in tasks:
                tasks[name] = shown.add_task(name, total=total, completed=done)
            shown.update(tasks[name], completed=done)

        yield show


@contextmanager
def counting(name: str, total: int, done: int = 0) -> Iterator[Callable[[int], None]]:
    """Show one progress bar; yield a function that sets its count."""
    with bars() as show:
        show(name, done, total)
        yield lambda count: show(name, count, total)


def render_missing(store: SampleStore, render: Callable[[Callable[[int], None]], object]) -> None:
    """Call a function that renders a store's missing samples, and show its progress."""
    done = store.rendered_samples()
    with counting("rendering", done + store.missing_samples(), done) as show:

        def advance(new: int) -> None:
            nonlocal done
            done += new
            show(done)

        render(advance)


def print_facts(title: str, rows: list[tuple[str, str]]) -> None:
    """Print names and values as a two-column table."""
    table = Table(title=Text(title), title_justify="left", show_header=False, box=None)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, value in rows:
        table.add_row(name, Text(value))
    console.print(table)


def print_table(title: str, heading: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table; if the output is not a terminal, nothing is cut off."""
    table = Table(title=Text(title), title_justify="left")
    for number, name in enumerate(heading):
        table.add_column(Text(name), justify="right" if number else "left")
    for row in rows:
        table.add_row(*map(Text, row))
    wide = console if console.is_terminal else Console(file=console.file, width=WIDE)
    wide.print(table)
