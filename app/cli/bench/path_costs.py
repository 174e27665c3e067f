"""``bench path-costs``: time of a path-traced sample over opacity, bounces and processors."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from app.cli.bench.machine import print_machine
from app.cli.bench.path import VIEWS
from app.cli.console import print_table
from app.cli.outputs import write_json
from model.benchmarks.path_costs import path_costs
from model.scene.first_picture import first_picture
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes


def bench_path_costs(paths: list[Path] | None, size: int, json_path: Path | None) -> None:
    """Measure each volume under its first TF; print tables, write JSON if requested."""
    machine, found = print_machine(), {}
    for path in paths or shipped_volumes():
        volume, tf = first_picture(read_volume(path))
        costs = list(path_costs(volume, SceneInputs.of(VIEWS[0], tf, light=LightDirection()), size))
        found[volume.name] = [asdict(cost) for cost in costs]
        print_table(
            f"{volume.name}, one sample of each of {size} x {size} pixels",
            ("opacities", "bounces", "threads", "seconds", "mean opacity"),
            [
                (
                    f"x {cost.opacity:g}",
                    str(cost.bounces),
                    str(cost.threads),
                    f"{cost.seconds:.2f}",
                    f"{cost.shown:.2f}",
                )
                for cost in costs
            ],
        )
    if json_path is not None:
        write_json(json_path, {"machine": machine, "volumes": found})
