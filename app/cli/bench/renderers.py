"""``bench renderers``: comparison of VTK and the ray caster."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from app.cli.bench.machine import machine_text, print_machine
from app.cli.console import console, counting, print_table
from app.cli.outputs import make_room_for, write_json
from app.figures.plots import Curve, Plot, save_plots
from model.benchmarks.renderers import RENDERERS, RendererComparison, compare_renderers
from model.scene.scene import Lighting, Scene
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

LABELS = {"vtk": "VTK", "raycast": "ray caster"}


def bench_renderers(
    paths: list[Path] | None,
    count: int,
    size: int,
    lighting: Lighting,
    seed: int,
    distances: list[float] | None,
    reference: float | None,
    preintegrated: bool,
    json_path: Path | None,
    plot: Path | None,
) -> None:
    """Compare the renderers on each volume; print tables, write JSON and a plot if requested."""
    machine = print_machine()
    comparisons = []
    for path in paths or shipped_volumes():
        volume = read_volume(path)
        scene = Scene.of(volume, size, lighting)
        with counting(volume.name, 0) as (progress, task):
            comparison = compare_renderers(
                volume,
                scene,
                count,
                seed,
                distances,
                reference,
                preintegrated,
                lambda done, total: progress.update(task, completed=done, total=total),
            )
        comparisons.append(comparison)
        _print(comparison)
    if json_path is not None:
        result = {"machine": machine, "volumes": [c.to_json() for c in comparisons]}
        write_json(json_path, result)
    if plot is not None:
        make_room_for(plot)
        save_plots(
            plot,
            [_plot(comparison) for comparison in comparisons],
            caption="Beside the points: sample distance in voxels. Errors are against VTK at "
            f"{comparisons[0].reference_distance:g} voxels, at {count} random "
            f"views and TFs. {machine_text(machine)}.",
        )


def _print(comparison: RendererComparison) -> None:
    title = (
        f"{comparison.volume} {'x'.join(map(str, comparison.dimensions))}, "
        f"{comparison.lighting} lighting, {comparison.count} images of "
        f"{comparison.size} x {comparison.size}"
    )
    heading = (
        "sample\ndistance",
        *(f"{LABELS[name]}\nimages/s" for name in RENDERERS),
        "ratio",
        *(f"{LABELS[name]}\nRMSE" for name in RENDERERS),
        "between\nmean RMSE",
        "between\nlargest",
    )
    cells = [
        (
            f"{row.sample_distance:g}",
            *(f"{row.images_per_second[name]:.1f}" for name in RENDERERS),
            f"{row.speedup:.1f}",
            *(f"{row.error[name]:.4f}" for name in RENDERERS),
            f"{row.difference:.4f}",
            f"{row.worst_difference:.4f}",
        )
        for row in comparison.rows
    ]
    print_table(title, heading, cells, left=0)
    facts = [f"min-max cells: {100 * comparison.cells_share:.1f} % of the volume's memory"]
    facts += [
        f"sensitivity, {name}: {cost:.1f} images"
        for name, cost in comparison.derivative_costs.items()
    ]
    console.print(
        f"RMSE against VTK at {comparison.reference_distance:g} voxels; " + "; ".join(facts)
    )


def _plot(comparison: RendererComparison) -> Plot:
    curves = tuple(
        Curve(
            LABELS[name],
            np.array([row.images_per_second[name] for row in comparison.rows]),
            np.array([row.error[name] for row in comparison.rows]),
            tuple(f"{row.sample_distance:g}" for row in comparison.rows),
        )
        for name in RENDERERS
    )
    return Plot(
        f"{comparison.volume}, lighting {comparison.lighting}, {comparison.size} x "
        f"{comparison.size} pixels",
        "images per second",
        "image RMSE",
        curves,
        logarithmic=True,
    )
