"""``bench generator``: speed of a generator by backend."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import torch

from app.cli.bench.machine import print_machine
from app.cli.console import console, print_table
from app.cli.outputs import write_json
from model.benchmarks.generator import BackendRow, PartsRow, compare_backends, time_parts
from model.devices import choose_device
from model.networks.blocks import kaiming_init
from model.networks.build import build_generator
from model.networks.checkpoint import load_model
from model.networks.generator_network import GeneratorNetwork
from model.scene.scene import Scene
from model.training.options import PRESETS
from model.volume_files import read_volume
from model.volume_files.shipped import DEFAULT_VOLUME


def bench_generator(
    presets: list[str], model: Path | None, device_name: str, seconds: float, json_path: Path | None
) -> None:
    """Measure a model or each preset's networks; print tables, and write JSON if requested."""
    device = choose_device(device_name)
    machine = print_machine(device)
    results = []
    for name, network, scene in _networks(presets, model):
        rows = list(compare_backends(network, scene, device, seconds))
        parts = time_parts(network, scene, device, seconds)
        _print(name, rows, parts)
        results.append(
            {
                "name": name,
                "backends": [asdict(row) for row in rows],
                "features": [asdict(row) for row in parts],
            }
        )
    if json_path is not None:
        write_json(json_path, {"machine": machine, "generators": results})


def _networks(presets: list[str], model: Path | None) -> list[tuple[str, GeneratorNetwork, Scene]]:
    """Return the networks to measure: a model's, or untrained ones, which are equally fast."""
    if model is not None:
        card, network = load_model(model)
        return [(str(model), network, card.scene)]
    volume = read_volume(DEFAULT_VOLUME)
    found: list[tuple[str, GeneratorNetwork, Scene]] = []
    for name in presets or PRESETS:
        size = PRESETS[name]
        scene = Scene.of(volume, size.image_size)
        torch.manual_seed(0)
        network = build_generator(size, scene)
        kaiming_init(network)
        found.append((f"{name}, untrained", network, scene))
    return found


def _print(name: str, rows: list[BackendRow], parts: list[PartsRow]) -> None:
    heading = ("backend", "precision", "images", "ms", "images/s", "over eager", "difference")
    print_table(name, heading, [_cells(row) for row in rows if row.obstacle is None], left=2)
    console.print("difference: the largest from eager float32, in steps of 1/255")
    for row in rows:
        if row.obstacle and row.batch == rows[0].batch:
            console.print(f"{row.backend}, {row.precision}: left out, as {row.obstacle}.")
    for part in parts:
        console.print(
            f"{part.batch} images: {1e3 * part.features:.1f} ms before that, for codes of view and "
            "TFs."
        )


def _cells(row: BackendRow) -> list[str]:
    assert row.seconds is not None
    return [
        row.backend,
        row.precision,
        str(row.batch),
        f"{1e3 * row.seconds:.1f}",
        f"{row.batch / row.seconds:.0f}",
        f"{row.speedup:.2f}",
        f"{row.difference:.2f}",
    ]
