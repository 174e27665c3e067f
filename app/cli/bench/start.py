"""``bench start``: how long the window takes to show something, and its memory."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from app.cli.bench.machine import print_machine
from app.cli.console import print_table
from app.cli.outputs import write_json
from model.errors import RenderError
from model.volume_files.shipped import shipped_volumes

ROOT = Path(__file__).resolve().parents[3]

NAMES = {
    "window": "window, s",
    "reference": "reference, s",
    "generator": "generator, s",
    "settled": "both final, s",
    "memory": "most memory, MB",
    "rest": "at rest, MB",
}
"""Columns, by what the probe measures."""


def bench_start(
    paths: list[Path] | None, model: Path | None, repeats: int, json_path: Path | None
) -> None:
    """Start the window anew for each volume; print the medians."""
    machine = print_machine()
    rows = []
    results: list[dict[str, Any]] = []
    for path in paths or shipped_volumes():
        # The first start compiles kernels, and fills the system's file cache.
        _measured(path, model)
        runs = [_measured(path, model) for _ in range(repeats)]
        medians = {n: statistics.median(r[n] for r in runs) for n in NAMES if n in runs[0]}
        rows.append([path.name, *(_cell(name, medians.get(name)) for name in NAMES)])
        results.append({"volume": path.name, **medians})
    print_table("From the start of the program", ("volume", *NAMES.values()), rows)
    if json_path is not None:
        write_json(json_path, {"machine": machine, "repeats": repeats, "volumes": results})


def _measured(path: Path, model: Path | None) -> dict[str, float]:
    probe = [sys.executable, "-m", "app.cli.bench.start_probe"]
    command = [*probe, str(path.absolute()), str(time.time())]
    if model is not None:
        command.append(str(model.absolute()))
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    lines = done.stdout.strip().splitlines()
    if done.returncode or not lines:
        told = (done.stderr.strip().splitlines() or ["it said nothing"])[-1]
        raise RenderError(f"{path}: the window could not be started: {told}")
    found: dict[str, float] = json.loads(lines[-1])
    return found


def _cell(name: str, value: float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.0f}" if name in ("memory", "rest") else f"{value:.1f}"
