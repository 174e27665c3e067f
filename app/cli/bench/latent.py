"""``bench latent``: speed of the latent browser's parts."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from app.cli.bench.machine import print_machine
from app.cli.console import console, print_table
from app.cli.outputs import write_json
from app.cli.window import window_volume
from model.benchmarks.latent import (
    Draw,
    LatentRow,
    MapRow,
    SearchRow,
    time_codes,
    time_engine,
    time_map,
    time_searches,
)
from model.generator.catalog import model_for
from model.generator.generator import Generator
from model.latent.goal_search import SEARCH_SIZE
from model.latent.latent_space import LatentSpace
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene, default_scalar_window
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes


def bench_latent(
    volumes: list[Path] | None,
    size: int,
    view: View,
    with_tsne: bool,
    with_window: bool,
    seed: int,
    json_path: Path | None,
    model: Path | None = None,
) -> None:
    """Time the browser's parts on volumes with the ray caster, and with their models."""
    machine = print_machine()
    results = []
    if model is not None and not volumes:
        volumes = [window_volume(None, model)]
    for path in volumes or shipped_volumes():
        volume = read_volume(path)
        console.print(f"\n{volume.name} {volume.dimensions}")
        with console.status("Drawing maps, grids and searches"):
            found = _measure(volume, size, view, with_tsne, seed, model)
        _tell(*found)
        rows, map_row, searches = found
        rates = {}
        if with_window:
            from app.cli.bench.window_pace import measure_browser

            rates = measure_browser(path, model)
            told = (f"{name} {rate:.0f}" for name, rate in rates.items())
            console.print(f"In the window, a second: {', '.join(told)}")
        results.append(
            {
                "volume": volume.name,
                "engines": [asdict(row) for row in rows],
                "map": asdict(map_row),
                "searches": [asdict(row) for row in searches],
                "window": rates,
            }
        )
    if json_path is not None:
        write_json(json_path, {"machine": machine, "volumes": results})


def _measure(
    volume: Volume, size: int, view: View, with_tsne: bool, seed: int, model: Path | None
) -> tuple[list[LatentRow], MapRow, list[SearchRow]]:
    folder = model or model_for(volume.fingerprint)
    generator = None if folder is None else Generator.load(folder, "auto", "auto", "auto")
    if model is not None:
        space = LatentSpace.of_model(model)
    else:
        space = LatentSpace.shipped(
            volume.scalar_range, default_scalar_window(volume), volume.scale
        )
    map_ = space.open_map()
    inputs = SceneInputs.of(view, default_transfer_function(volume))
    scene = Scene.of(volume, size)
    renderer = RaycastRenderer(volume)

    def ray_caster(some: list[SceneInputs], pixels: int) -> Any:
        return np.stack([renderer.render(one, pixels) for one in some])

    engines: list[tuple[str, Draw, int]] = [("ray caster", ray_caster, size)]
    if generator is not None:
        learned = generator
        engines.append(
            ("model", lambda some, _size: learned.render_batch(some), learned.scene.image_size)
        )
    try:
        rows = [
            time_engine(name, draw, pixels, space, map_, inputs) for name, draw, pixels in engines
        ]
        if model is not None and generator is not None:
            rows.append(time_codes("model, codes", generator, map_, inputs))
        searches = [
            time_searches(
                name,
                draw,
                SEARCH_SIZE if name == "ray caster" else pixels,
                volume,
                space,
                map_,
                scene,
                seed,
            )
            for name, draw, pixels in engines
        ]
        return rows, time_map(volume, space, map_, inputs, with_tsne), searches
    finally:
        renderer.close()


def _tell(rows: list[LatentRow], map_row: MapRow, searches: list[SearchRow]) -> None:
    heading = (
        "engine", "pixels", "image", "grid", "in images", "per s", "hover", "in images", "per s",
    )  # fmt: skip
    cells = [
        (
            row.engine,
            str(row.size),
            f"{1000 * row.image:.1f} ms",
            f"{1000 * row.grid:.0f} ms",
            f"{row.grid / row.image:.1f}",
            f"{1 / row.grid:.1f}",
            f"{1000 * row.hover:.1f} ms",
            f"{row.hover / row.image:.2f}",
            f"{1 / row.hover:.0f}",
        )
        for row in rows
    ]
    print_table("", heading, cells)
    image = rows[0].image
    parts = {
        "sampling": map_row.sampling,
        "cells": map_row.cells,
        "interpolation": map_row.blend,
        "placement": map_row.placement,
        "overview": map_row.overview,
        "t-SNE": map_row.tsne,
    }
    told = (
        f"{name} {1000 * seconds:.1f} ms ({seconds / image:.2g} images)"
        for name, seconds in parts.items()
        if seconds is not None
    )
    console.print(f"{map_row.samples:,} samples: {', '.join(told)}")
    for search in searches:
        seconds = float(np.median(search.seconds))
        console.print(
            f"Search, {search.engine}: RMSE median {np.median(search.errors):.4f}, "
            f"quartile 3 {np.quantile(search.errors, 0.75):.4f}, largest "
            f"{max(search.errors):.3f}; {np.median(search.images):.0f} pictures, {seconds:.1f} s"
        )
