"""``bench sizes``: cost of an image over the size of the volume."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from app.cli.bench.machine import machine_text, print_machine
from app.cli.console import console, print_table
from app.cli.outputs import make_room_for, write_json
from app.figures.plots import Curve, Plot, save_plots
from model.benchmarks.volume_sizes import LIGHTINGS, CostRow, costs_over_sizes
from model.volume_files.source import VolumeSource

NAMES = {"raycast": "ray caster", "vtk": "VTK"}


def bench_sizes(
    source: VolumeSource,
    edges: list[int],
    size: int,
    count: int,
    slowest: float,
    json_path: Path | None,
    plot: Path | None,
) -> None:
    """Time images for each size; print a table, write JSON and a plot if requested."""
    machine = print_machine()
    volume = source.read()
    rows = []
    for row in costs_over_sizes(volume, tuple(sorted(edges)), size, count, slowest):
        times = (f"{NAMES[name]} {1e3 * taken:.0f} ms" for name, taken in row.seconds.items())
        console.print(f"{row.edge} voxels, {row.lighting}: {', '.join(times)}")
        rows.append(row)
    _print(f"{volume.name}, {size} x {size}, {count} images each, ms per image", rows)
    if json_path is not None:
        write_json(json_path, {"machine": machine, "rows": [asdict(row) for row in rows]})
    if plot is not None:
        make_room_for(plot)
        save_plots(
            plot,
            [_plot(volume.name, rows, lighting, size) for lighting in LIGHTINGS],
            height=300,
            caption=f"Beside the points: ms per image, at {count} random views and TFs, of the "
            f"volume averaged or enlarged. {machine_text(machine)}.",
        )


def _print(title: str, rows: list[CostRow]) -> None:
    cells = []
    for row in rows:
        times = (row.seconds.get(name) for name in NAMES)
        told = ("" if taken is None else f"{1e3 * taken:.0f}" for taken in times)
        cells.append((row.lighting, str(row.edge), *told))
    print_table(title, ("lighting", "voxels along\nthe longest axis", *NAMES.values()), cells)


def _plot(volume: str, rows: list[CostRow], lighting: str, size: int) -> Plot:
    curves = []
    for name, label in NAMES.items():
        points = [
            (row.edge, 1e3 * row.seconds[name])
            for row in rows
            if row.lighting == lighting and name in row.seconds
        ]
        edges, times = np.array(points, dtype=float).reshape(-1, 2).T
        curves.append(Curve(label, edges, times, tuple(f"{t:.0f}" for t in times)))
    title = f"{volume}, lighting {lighting}, {size} x {size} pixels"
    return Plot(
        title, "voxels along the longest axis", "ms per image", tuple(curves), logarithmic=True
    )
