"""What benchmarks share: their options, random scenes, times, processes of their own, tables."""

import argparse
import json
import os
import subprocess
import sys
import time
from functools import partial
from importlib.metadata import version
from pathlib import Path

from app.cli.console import console, print_table
from model.measurements import processor_name
from model.samples.sampling import draw_sample
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

ROOT = Path(__file__).resolve().parents[2]

HELP = {
    **{"count": "random views and TFs", "size": "pixels of a side", "seconds": "of a drag"},
    "burners": "other processes that keep the processors busy",
}


def options(about, **defaults):
    """A parser with `--volume` and an option for each default."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--volume", type=Path, action="append", help="may be repeated")
    for name, default in defaults.items():
        parser.add_argument(f"--{name}", type=type(default), default=default, help=HELP.get(name))
    return parser


def parsed(parser, arguments):
    """What is asked for; prints what the measurements depend on."""
    asked = parser.parse_args(arguments)
    libraries = ", ".join(f"{name} {version(name)}" for name in ("vtk", "numba", "torch"))
    console.print(f"{processor_name()}, {os.cpu_count()} cores, {libraries}")
    return asked


def paths(asked):
    """The volumes' files: those named, or those shipped."""
    return asked.volume or list(shipped_volumes())


def volumes(asked):
    """Read one volume after the other."""
    return map(read_volume, paths(asked))


def draw_scenes(scene, count):
    """Random views and TFs."""
    return [draw_sample(scene, 0, "holdout", number) for number in range(count)]


def timed(call):
    """What a call gives, and its seconds."""
    begun = time.perf_counter()
    found = call()
    return found, time.perf_counter() - begun


def in_turn(ways, inputs):
    """For each input yield each way's result and seconds, the ways in turn, without compilation."""
    for way in ways.values():
        way(inputs[0])
    for item in inputs:
        yield {name: timed(partial(way, item)) for name, way in ways.items()}


def probed(name, *words, **environment):
    """What `--probe` of a benchmark prints, in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", f"tests.benchmarks.{name}", "--probe", *map(str, words)],
        cwd=ROOT,
        env=os.environ | environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return json.loads(done.stdout.splitlines()[-1])


def print_rows(title, heading, rows):
    """Print a table of names and numbers."""
    print_table(title, heading, [[_text(cell) for cell in row] for row in rows])


def _text(cell):
    if isinstance(cell, float):
        return f"{cell:.0f}" if abs(cell) >= 100 else f"{cell:.3g}"
    return "" if cell is None else str(cell)
