"""``bench tradeoff``: time and error of all settings of a picture, and which are worth it."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from app.cli.bench.machine import machine_text, print_machine
from app.cli.bench.other_drawers import other_drawers
from app.cli.console import console, counting, print_table
from app.cli.outputs import make_room_for, write_json
from app.cli.render import choose_tf
from app.figures.plots import Curve, Plot, save_plots
from model.evaluation.tradeoff import Measured, Tradeoff, measure_tradeoff, settings_of
from model.generator.path_light_generator import cleaning_of
from model.rendering.setting import Setting
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import Lighting, Scene
from model.scene.transfer_function import TransferFunction
from model.scene.view import View
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

LEAST_SHOWN = 1e-6
"""Error at the lower end of a plot."""


def bench_tradeoff(
    paths: list[Path] | None,
    lightings: list[Lighting],
    count: int,
    size: int,
    view: View | None,
    tf: Path | None,
    seed: int,
    vtk: bool,
    threads: int | None,
    json_path: Path | None,
    plot: Path | None,
) -> None:
    """Measure each volume under each lighting; print tables, write JSON and a plot if requested.

    A view or a TF takes the place of random ones.
    """
    machine = print_machine()
    found = []
    for path in paths or shipped_volumes():
        volume = read_volume(path)
        for lighting in lightings:
            chosen, shown = choose_tf(tf, volume, False) if tf or view else (None, volume)
            scene = Scene.of(shown, size, lighting)
            scenes = _scenes(scene, seed, 1 if view and tf else count, view, chosen)
            cleaning, release = cleaning_of(shown, scene.light, lighting == "path")
            settings = settings_of(lighting, vtk, cleaning is not None)
            with (
                other_drawers(shown, scene) as others,
                counting(f"{volume.name}, {lighting}", len(settings) + len(others)) as (
                    progress,
                    task,
                ),
            ):
                tradeoff = measure_tradeoff(
                    shown,
                    lighting,
                    scene.light,
                    scenes,
                    size,
                    settings,
                    lambda done, total, p=progress, t=task: p.update(t, completed=done),  # type: ignore[misc]
                    threads,
                    cleaning,
                    others,
                )
            release()
            found.append(tradeoff)
            _print(tradeoff)
    if json_path is not None:
        tradeoffs = [_plain(each) for each in found]
        write_json(json_path, {"machine": machine, "threads": threads, "tradeoffs": tradeoffs})
    if plot is not None:
        make_room_for(plot)
        save_plots(
            plot,
            [_plot(each) for each in found],
            caption="Beside the points that are worth it: sample distance in voxels (samples in "
            "path-traced light), and pixels drawn for each pixel shown. Errors are against the "
            f"exact picture of the same light. {machine_text(machine)}.",
        )


def _scenes(
    scene: Scene, seed: int, count: int, view: View | None, tf: TransferFunction | None
) -> list[SceneInputs]:
    """Draw random scenes, in which a view or a TF that is given takes the place of its own."""
    drawn = [draw_sample(scene, seed, "holdout", number) for number in range(count)]
    return [
        SceneInputs.of(view or each.view, tf or each.transfer_function, light=each.light)
        for each in drawn
    ]


def _print(tradeoff: Tradeoff) -> None:
    sides = "x".join(map(str, tradeoff.dimensions))
    cells = [
        (
            "*" if point.setting in tradeoff.front else "",
            point.setting.text(tradeoff.lighting),
            f"{1e3 * point.seconds:.1f}",
            f"{point.rmse:.4f}",
            f"{point.worst:.4f}",
            f"{point.flip:.4f}",
            f"{point.largest:.2f}",
        )
        for point in tradeoff.points
    ]
    print_table(
        f"{tradeoff.volume} {sides}, {tradeoff.lighting} lighting, {tradeoff.count} "
        f"scenes of {tradeoff.size} x {tradeoff.size}",
        ("", "setting", "ms", "RMSE", "worst scene", "FLIP", "largest"),
        cells,
        left=2,
    )
    console.print(
        f"*: no other setting is both faster and nearer. Exact: "
        f"{tradeoff.exact.text(tradeoff.lighting)}, {1e3 * tradeoff.exact_seconds:.1f} ms"
    )


def _plain(tradeoff: Tradeoff) -> dict[str, Any]:
    data = asdict(tradeoff)
    del data["front"]
    for point, plain in zip(tradeoff.points, data["points"], strict=True):
        plain["on_front"] = point.setting in tradeoff.front
    return data


def _plot(tradeoff: Tradeoff) -> Plot:
    worth = [point for point in tradeoff.points if point.setting in tradeoff.front]
    others = [point for point in tradeoff.points if point.setting not in tradeoff.front]
    curves = _curve("worth it", worth, tradeoff.lighting), _curve("others", others, None)
    return Plot(
        f"{tradeoff.volume}, lighting {tradeoff.lighting}, "
        f"{tradeoff.size} x {tradeoff.size} pixels",
        "ms per picture",
        "image RMSE",
        curves,
        logarithmic=True,
    )


def _curve(name: str, points: list[Measured], lighting: Lighting | None) -> Curve:
    """Return points as a curve; those without a lighting have neither line nor texts."""
    return Curve(
        name,
        np.array([1e3 * point.seconds for point in points]),
        # A picture of nothing has no error, and no place on a logarithmic axis.
        np.array([max(point.rmse, LEAST_SHOWN) for point in points]),
        () if lighting is None else tuple(_label(each.setting, lighting) for each in points),
        joined=lighting is not None,
    )


def _label(setting: Setting, lighting: Lighting) -> str:
    first = f"{setting.samples}" if lighting == "path" else f"{setting.sample_distance:g}"
    rest = "" if setting.pixels == 1 else f", 1/{1 / setting.pixels:g}"
    return ("VTK " if setting.renderer == "vtk" else "") + first + rest
