"""Sentences, tables and progress bars in the terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from model.scene.volume import Volume

if TYPE_CHECKING:
    from model.samples.sample_store import SampleStore

WIDE = 200  # columns of a table that is printed into a file, which does not end at 80
console = Console(markup=False, highlight=False, soft_wrap=True)


def warn(message: str) -> None:
    """Print a sentence on standard error, where it disturbs no result on standard output."""
    print(f"tfscope: {message}", file=sys.stderr)


def warn_of(volume: Volume) -> None:
    """Print what the reader of a volume assumed or changed."""
    for note in volume.notes:
        warn(note)


def about(seconds: float) -> str:
    """Say a duration in words, as roughly as it is known."""
    if seconds < 45:
        return "less than a minute"
    if seconds >= 2 * 86400:
        return f"about {seconds / 86400:.0f} days"
    if seconds >= 2 * 3600:
        return f"about {seconds / 3600:.0f} hours"
    minutes = max(round(seconds / 60), 1)
    return "about a minute" if minutes == 1 else f"about {minutes} minutes"


class _SpeedColumn(ProgressColumn):
    """Column with the number of items per second."""

    def render(self, task: Task) -> Text:
        speed = task.finished_speed or task.speed
        return Text("" if speed is None else f"{speed:.1f}/s")


@contextmanager
def counting(description: str, total: int, done: int = 0) -> Iterator[Callable[[int], None]]:
    """Show a bar with item count, speed and remaining time; yield what sets the count."""
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        _SpeedColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
        speed_estimate_period=60,
    ) as progress:
        task = progress.add_task(description, total=total, completed=done)
        yield lambda count: progress.update(task, completed=count)


def render_missing(store: SampleStore, render: Callable[[Callable[[int], None]], object]) -> None:
    """Render a store's missing samples by a function that reports new ones, and show their bar."""
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
    """Print a table as wide as it is: where the output is no terminal, nothing is cut."""
    table = Table(title=Text(title), title_justify="left")
    for number, name in enumerate(heading):
        table.add_column(Text(name), justify="right" if number else "left")
    for row in rows:
        table.add_row(*map(Text, row))
    wide = console if console.is_terminal else Console(file=console.file, width=WIDE)
    wide.print(table)
