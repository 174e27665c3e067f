"""``bench path-sensitivity``: what stands in for the derivative of path-traced pictures."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from statistics import median

from app.cli.bench.machine import print_machine
from app.cli.bench.path import VIEWS
from app.cli.console import print_table
from app.cli.outputs import write_json
from model.benchmarks.path_sensitivity import StandInRow, stand_in_rows
from model.scene.first_picture import first_picture
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes


def bench_path_sensitivity(
    paths: list[Path] | None, size: int, truth: int, json_path: Path | None
) -> None:
    """Measure each volume under its first TF from the first view; print medians, write JSON."""
    machine = print_machine()
    found: dict[str, list[StandInRow]] = {}
    for path in paths or shipped_volumes():
        volume, tf = first_picture(read_volume(path))
        scenes = [SceneInputs.of(VIEWS[0], tf, light=LightDirection())]
        found[volume.name] = list(stand_in_rows(volume, scenes, size, truth))
    rows = [row for each in found.values() for row in each]
    cells = []
    for way in dict.fromkeys(row.way for row in rows):
        alike = [row for row in rows if row.way == way]
        names = ("whole", "middle", "field")
        cosines = [[getattr(row, name) for row in alike] for name in names]
        told = [f"{median(each):.3f} ({min(each):.3f})" for each in cosines]
        cells.append((way, *told, f"{median(row.seconds for row in alike):.2f}"))
    columns = ("way", "whole picture", "middle", "field", "seconds")
    title = f"Cosine to {truth} samples, {size} x {size}, {len(found)} volumes: median (least)"
    print_table(title, columns, cells)
    if json_path is not None:
        volumes = {name: [asdict(row) for row in each] for name, each in found.items()}
        write_json(json_path, {"machine": machine, "volumes": volumes})
