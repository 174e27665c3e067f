"""``bench sizes``: cost of an image over the size of the volume."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.table import Table

from app.cli.console import console
from app.cli.machine import machine_text, print_machine
from app.cli.outputs import make_room_for, write_json
from app.figures.plots import Curve, Plot, save_plots
from model.benchmarks.volume_sizes import LIGHTINGS, CostRow, costs_over_sizes
from model.volume_files.source import VolumeSource

NAMES = {"raycast": "ray caster", "vtk": "VTK", "model": "model"}


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
    table = Table(title=title, title_justify="left")
    table.add_column("voxels along\nthe longest axis", justify="right")
    table.add_column("lighting")
    for name in NAMES.values():
        table.add_column(name, justify="right")
    for row in rows:
        times = (row.seconds.get(name) for name in NAMES)
        cells = ("" if taken is None else f"{1e3 * taken:.0f}" for taken in times)
        table.add_row(str(row.edge), row.lighting, *cells)
    console.print(table)


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
