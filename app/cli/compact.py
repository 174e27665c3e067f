"""``compact``: a volume in few bytes."""

from __future__ import annotations

from pathlib import Path

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from app.cli.console import console
from app.cli.outputs import make_room_for
from model.evaluation.compact_saving import CompactOrder, save_compact
from model.scene.range_fitting import fit_to_volume
from model.scene.robust_range import robust_range
from model.scene.transfer_function import TransferFunction
from model.scene.view import View
from model.volume_files.source import VolumeSource


def save(
    source: VolumeSource,
    out: Path,
    megabytes: float | None,
    error: float | None,
    tf: Path | None,
    view: View | None,
) -> None:
    """Save a compact volume with a progress bar, and print its size and error."""
    order = CompactOrder(out, megabytes, error)
    volume = source.read_whole()
    first = None
    if tf is not None:
        first = fit_to_volume(TransferFunction.load(tf), volume.over(robust_range(volume)))
    order = CompactOrder(out, megabytes, error, first, view)
    make_room_for(out)
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
    ) as progress:
        task = progress.add_task("compressing", total=1)
        result = save_compact(
            volume,
            order,
            lambda what, done: progress.update(task, description=what, completed=done),
        )
    console.print(f"{out}: {result.sentence}")
