"""``bench training``: speed of training steps by precision, memory order and so on."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from app.cli.bench.machine import print_machine
from app.cli.console import print_table
from app.cli.outputs import write_json
from model.benchmarks.training import TrainingRow, compare_batches, compare_training
from model.devices import choose_device
from model.scene.scene import Scene
from model.training.options import PRESETS, TrainingOptions
from model.volume_files import read_volume
from model.volume_files.shipped import DEFAULT_VOLUME


def bench_training(
    presets: list[str],
    device_name: str,
    steps: int,
    batches: list[int],
    settings: list[str],
    json_path: Path | None,
) -> None:
    """Time training steps; print a table per preset, and write JSON if requested."""
    device = choose_device(device_name)
    machine = print_machine(device)
    volume = read_volume(DEFAULT_VOLUME)
    results = []
    for name in presets or ["draft", "compact"]:
        size = PRESETS[name]
        scene = Scene.of(volume, size.image_size)
        recipe = TrainingOptions().with_settings(settings)
        if batches:
            found = compare_batches(size, recipe, scene, volume, device, steps, batches)
        else:
            found = compare_training(size, recipe, scene, device, steps)
        rows = list(found)
        _print(name, rows)
        results.append({"name": name, "rows": [asdict(row) for row in rows]})
    if json_path is not None:
        write_json(json_path, {"machine": machine, "presets": results})


def _print(name: str, rows: list[TrainingRow]) -> None:
    heading = (
        "stage", "precision", "channels", "fused", "compiled", "rendering", "train",
        "batch", "ms a step", "samples/s", "ratio",
    )  # fmt: skip
    cells = [
        (
            row.stage,
            row.execution.precision,
            "last" if row.execution.channels_last else "first",
            "yes" if row.execution.fused else "no",
            "yes" if row.execution.compiled else "no",
            "beside" if row.rendered else "none",
            "takes this" if row.chosen else "",
            str(row.batch_size),
            f"{1e3 * row.seconds:.0f}",
            f"{row.batch_size / row.seconds:.0f}",
            f"{row.speedup:.2f}",
        )
        for row in rows
    ]
    print_table(name, heading, cells, left=7)
