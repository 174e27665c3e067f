"""``bench path``: time and error of path-traced pictures over the number of samples."""

from __future__ import annotations

from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from app.cli.bench.machine import print_machine
from app.cli.console import console, print_table
from app.cli.outputs import write_json
from model.benchmarks.flicker import Draw, flicker
from model.benchmarks.path_tracing import (
    OtherLightRow,
    PathRow,
    exact_pictures,
    other_light_rows,
    path_rows,
)
from model.generator.path_light_generator import cleaning_of
from model.rendering.path_tracing.cleaning import Cleaning, denoiser
from model.rendering.path_tracing.refinement import RefiningRenderer, drawn
from model.rendering.path_tracing.renderer import PathTracer
from model.scene.first_picture import first_picture
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

Image = NDArray[np.float32]

VIEWS = (View(30, 20, 0, 0.7), View(210, -10, 0, 0.7))
"""From two sides, close enough that the volume fills the picture."""


TURN = 1.0
"""Degrees between two frames of a movement."""

SETTLING = 4
"""Frames before those that count."""


def bench_path(
    paths: list[Path] | None,
    size: int,
    samples: int,
    truth: int,
    frames: int,
    other_lights: bool,
    json_path: Path | None,
) -> None:
    """Measure each volume under its first TF; print tables, write JSON if requested."""
    machine = print_machine()
    found = {}
    for path in paths or shipped_volumes():
        volume, tf = first_picture(read_volume(path))
        scenes = [SceneInputs.of(view, tf, light=LightDirection()) for view in VIEWS]
        exact = exact_pictures(volume, scenes, size, truth)
        rows = list(path_rows(volume, scenes, size, samples, exact))
        found[volume.name] = [asdict(row) for row in rows]
        _print(f"{volume.name}, {size} x {size}, {len(scenes)} views", rows)
        if other_lights:
            _print_lights(list(other_light_rows(volume, scenes, size, exact)))
        if frames:
            _print_flicker(volume, scenes[0], frames, size, truth)
    if json_path is not None:
        write_json(json_path, {"machine": machine, "volumes": found})


def _print_lights(rows: list[OtherLightRow]) -> None:
    cells = []
    for lighting in dict.fromkeys(row.lighting for row in rows):
        alike = [row for row in rows if row.lighting == lighting]
        cells.append(
            (
                lighting,
                f"{1e3 * fmean(row.seconds for row in alike):.0f}",
                f"{fmean(row.error for row in alike):.4f}",
                f"{fmean(row.brightened for row in alike):.4f}",
            )
        )
    print_table("Other lights in its place", ("light", "ms", "RMSE", "brightened"), cells)


def _print_flicker(volume: Volume, first: SceneInputs, frames: int, size: int, truth: int) -> None:
    """Turn a scene, and say how its pictures flicker, and how wrong they are."""
    view = first.view
    turned = [
        replace(first, view=replace(view, azimuth=view.azimuth + TURN * number))
        for number in range(SETTLING + frames)
    ]
    tracers = [PathTracer(volume, seed=seed) for seed in (0, 1, 2)]
    cleaning, release = cleaning_of(volume)

    def draw(inputs: SceneInputs, seed: int, samples: int, way: Cleaning | None) -> Image:
        return drawn(tracers[seed], inputs, size, samples, cleaning=way).rgba

    draws: dict[str, Draw] = {"1 sample, as traced": partial(draw, seed=0, samples=1, way=None)}
    if cleaning is not None:
        draws["1 sample, denoised"] = partial(draw, seed=0, samples=1, way=denoiser)
        draws["1 sample, finished"] = partial(draw, seed=0, samples=1, way=cleaning)
        moving = RefiningRenderer(tracers[0], cleaning)
        draws["while something moves"] = partial(_moved, moving, size=size)
    # Of pictures that nobody would call noisy: what the truth itself leaves.
    draws[f"{truth} other samples"] = partial(draw, seed=2, samples=truth, way=cleaning)
    right = partial(draw, seed=1, samples=truth, way=cleaning)
    found = flicker(draws, right, turned, SETTLING)
    print_table(
        f"Turning by {TURN:g} degree a frame",
        ("picture", "ms", "RMSE", "flicker, 99 %", "mean"),
        [
            (name, f"{1e3 * f.seconds:.0f}", f"{f.error:.4f}", f"{f.most:.1f}", f"{f.mean:.2f}")
            for name, f in found.items()
        ],
    )
    for each in (release, *(tracer.close for tracer in tracers)):
        each()


def _moved(renderer: RefiningRenderer, inputs: SceneInputs, size: int) -> Image:
    picture = renderer.moving(inputs, size)
    assert picture is not None
    return picture.rgba


def _print(title: str, rows: list[PathRow]) -> None:
    cells = []
    for samples in sorted({row.samples for row in rows}):
        alike = [row for row in rows if row.samples == samples]
        told = [row.told for row in alike if row.told is not None]
        cells.append(
            (
                str(samples),
                f"{fmean(row.seconds for row in alike):.2f}",
                f"{fmean(row.traced for row in alike):.4f}",
                f"{fmean(row.denoised for row in alike):.4f}",
                f"{fmean(row.shown for row in alike):.4f}",
                f"{fmean(told):.4f}" if told else "",
            )
        )
    print_table(
        title, ("samples", "seconds", "RMSE as traced", "denoised", "as shown", "told"), cells
    )
    judged = [row for row in rows if row.told is not None]
    good = sum(row.is_told_well for row in judged)
    console.print(f"The error that is told is within a factor of 1.5 in {good} of {len(judged)}.")
