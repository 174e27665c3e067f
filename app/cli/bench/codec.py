"""``bench codec``: accuracy of latent codes of opacity TFs, without rendering."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path

from app.cli.bench.machine import print_machine
from app.cli.console import console, print_table
from app.cli.outputs import write_json
from model.benchmarks.codec import LAYERS, CodecRow, measure_codec, train_codec
from model.errors import TfscopeError
from model.networks.checkpoint import load_model
from model.scene.scene import Scene
from model.training.options import PRESETS, TrainingOptions
from model.volume_files import read_volume
from model.volume_files.shipped import DEFAULT_VOLUME


def measure_model(model: Path, ineffective: list[str], json_path: Path | None) -> None:
    """Measure a trained model's codec; raise an error for options that apply to training only."""
    if ineffective:
        raise TfscopeError(
            f"With --model, {' and '.join(ineffective)} would have no effect: its codec is "
            "trained already; leave that out, or leave --model out."
        )
    card, network = load_model(model)
    _tell([measure_codec(network.codec, card.scene)], json_path)


def train_alone(
    volume: Path | None,
    preset: str,
    steps: int,
    settings: tuple[str, ...],
    seed: int,
    json_path: Path | None,
) -> None:
    """Train a codec without images, and measure it during training."""
    options = replace(TrainingOptions(), seed=seed).with_settings(settings)
    size = PRESETS[preset]
    scene = Scene.of(read_volume(volume or DEFAULT_VOLUME), size.image_size)
    _tell(list(_watched(train_codec(size, options, scene, steps))), json_path)


def _watched(rows: Iterator[CodecRow]) -> Iterator[CodecRow]:
    with console.status("Learning opacity TFs") as status:
        for row in rows:
            status.update(f"Learning opacity TFs: {row.steps} steps done")
            yield row


def _tell(rows: list[CodecRow], json_path: Path | None) -> None:
    """Print a table, and write JSON if a path is given."""
    machine = print_machine()
    layers = (f"{n} voxels" if n > 1 else "TF" for n in LAYERS)
    cells = [
        (
            str(row.steps or "model"),
            *(f"{row.layer_rmse[n]:.4f}" for n in LAYERS),
            *(f"{cosine:.2f}" for cosine in row.edit_cosine),
        )
        for row in rows
    ]
    print_table("", ("steps", *layers, "10 %", "25 %", "median"), cells, left=0)
    console.print(
        "TF, voxels: RMSE of decoded TFs, and of the opacity of layers as thick as that (0..1)\n"
        "%, median, over TFs: cosine of what smooth edits do to the decoded TF with those edits"
    )
    if json_path is not None:
        write_json(json_path, {"machine": machine, "rows": [asdict(row) for row in rows]})
