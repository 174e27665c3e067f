"""What all benchmarks share: their options, random scenes, times, and tables."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from app.cli.console import console, print_table
from model.measurements import processor_name
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import Lighting, Scene
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes


def options(
    about: str | None, count: int = 10, size: int = 256, lighting: Lighting | None = None
) -> argparse.ArgumentParser:
    """Return a parser with the options of a benchmark; without `lighting` it has no such option."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--volume", type=Path, action="append", help="may be repeated")
    parser.add_argument("--count", type=int, default=count, help="random views and TFs")
    parser.add_argument("--size", type=int, default=size, help="pixels of a side")
    parser.add_argument("--seed", type=int, default=0)
    if lighting is not None:
        parser.add_argument("--lighting", default=lighting)
    return parser


def paths(asked: argparse.Namespace) -> list[Path]:
    """Return the volumes' files: those named, or those shipped."""
    return asked.volume or list(shipped_volumes())


def volumes(asked: argparse.Namespace) -> Iterator[Volume]:
    """Read one volume after the other."""
    return map(read_volume, paths(asked))


def scenes(volume: Volume, asked: argparse.Namespace, lighting: Lighting) -> list[SceneInputs]:
    """Return random views and TFs."""
    scene = Scene.of(volume, asked.size, lighting)
    return [draw_sample(scene, asked.seed, "holdout", number) for number in range(asked.count)]


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    """Return what a call gives, and its seconds."""
    begun = time.perf_counter()
    found = call()
    return found, time.perf_counter() - begun


def print_machine() -> None:
    """Say what the measurements depend on."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("vtk", "numba", "torch"))
    console.print(f"{processor_name()}, {os.cpu_count()} cores, {libraries}")


def print_rows(title: str, heading: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Print a table of names and numbers."""
    print_table(title, heading, [[_text(cell) for cell in row] for row in rows])


def _text(cell: object) -> str:
    if isinstance(cell, float):
        return f"{cell:.0f}" if abs(cell) >= 100 else f"{cell:.3g}"
    return "" if cell is None else str(cell)
