"""``bench sensitivity``: cost of sensitivities, in images."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from app.cli.bench.machine import print_machine
from app.cli.console import console, print_table
from app.cli.outputs import write_json
from model.benchmarks.sensitivity import SensitivityCost, exact_costs, learned_costs
from model.errors import RenderError
from model.generator.catalog import model_for
from model.generator.generator import Generator
from model.scene.scene import EXACT_LIGHTINGS, Lighting
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes


def bench_sensitivity(
    paths: list[Path] | None,
    size: int,
    count: int,
    lighting: Lighting,
    seed: int,
    window: bool,
    json_path: Path | None,
) -> None:
    """Time sensitivities of each volume, and of its shipped model; print tables."""
    if lighting not in EXACT_LIGHTINGS:
        raise RenderError(
            f"Images in {lighting} light have no exact derivative; "
            f"give {', '.join(EXACT_LIGHTINGS[:-1])} or {EXACT_LIGHTINGS[-1]}."
        )
    machine = print_machine()
    results: list[dict[str, Any]] = []
    for path in paths or shipped_volumes():
        volume = read_volume(path)
        costs = exact_costs(volume, lighting, size, count, seed)
        folder = model_for(volume.fingerprint)
        if folder is not None:
            # The device's own forward pass is the unit: derivatives go through torch, too.
            costs += learned_costs(Generator.load(folder, "auto", "eager"), count, seed)
        _print(volume.name, costs)
        result: dict[str, Any] = {"volume": volume.name, "costs": [c.to_json() for c in costs]}
        if window:
            from app.cli.bench.window_pace import measure_sensitivity

            result["window"] = measure_sensitivity(path, size)
            _print_window(volume.name, result["window"])
        results.append(result)
    if json_path is not None:
        write_json(json_path, {"machine": machine, "lighting": lighting, "volumes": results})


def _print(name: str, costs: list[SensitivityCost]) -> None:
    cells = [
        (cost.engine, cost.question, str(cost.size), f"{cost.ms:.1f}", f"{cost.images:.1f}")
        for cost in costs
    ]
    print_table(name, ("engine", "question", "size", "ms", "images"), cells, left=2)


def _print_window(name: str, rates: dict[str, float]) -> None:
    said = ", ".join(f"{what}: {rate:.0f} a second" for what, rate in rates.items())
    console.print(f"{name}, in the window: {said}")
