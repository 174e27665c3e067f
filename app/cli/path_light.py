"""``light``: pairs for the network behind the denoiser, and its training."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

from app.cli.console import console, counting, print_table
from model.devices import choose_device
from model.networks.path_light_network import PathLightCard, load_path_light, save_path_light
from model.samples.path_light_pairs import read_pairs, write_pairs
from model.training.path_light_training import (
    PathLightErrors,
    PathLightOptions,
    PathLightTrainer,
    described,
    path_light_errors,
)
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes


def draw_pairs(paths: list[Path] | None, out: Path, blocks: int, seed: int, samples: int) -> None:
    """Draw pairs of the volumes that are not there yet."""
    volumes = [read_volume(path) for path in paths or shipped_volumes()]
    with counting("Blocks of pairs", blocks * len(volumes)) as (progress, task):
        for _ in write_pairs(out, volumes, blocks, seed, samples):
            progress.advance(task)
    count = sum(len(each.error) for each in read_pairs(out).values())
    console.print(f"{out} has {count} pairs.")


def train_network(
    folder: Path,
    out: Path,
    held_out: Path | None,
    training: PathLightOptions,
    start_from: Path | None,
    device: str,
) -> None:
    """Train on pairs, measure on others, and write the network with what is known about it."""
    pairs, chosen = read_pairs(folder), choose_device(device)
    others = read_pairs(held_out) if held_out else {}
    start = None
    if start_from is not None:
        known_card, start = load_path_light(start_from)
        rate = training.learning_rate / 3
        training = replace(training, size=known_card.size, learning_rate=rate)
    trainer = PathLightTrainer(pairs, training, chosen, start)
    checkpoint = out.with_suffix(".training")
    if checkpoint.exists():
        trainer.resume(checkpoint)
        console.print(f"The training goes on after {trainer.seconds / 60:.1f} minutes.")
    count = sum(len(each.error) for each in pairs.values())
    weights = sum(weight.numel() for weight in trainer.network.parameters())
    console.print(f"{count} pairs of {len(pairs)} volumes; {weights:,} weights.")

    def say(loss: float) -> None:
        told = f"{trainer.seconds / 60:.1f} min, {trainer.steps:,} steps: loss {loss:.4f}"
        console.print(told + _told(path_light_errors(trainer.network, others, chosen)))

    out.parent.mkdir(parents=True, exist_ok=True)
    trainer.run(say, checkpoint)
    errors = path_light_errors(trainer.network, others, chosen) if others else []
    known = {str(each.samples): asdict(each) for each in errors}
    card = PathLightCard(training.size, described(training, trainer, count), known)
    save_path_light(out, card, trainer.network)
    checkpoint.unlink(missing_ok=True)
    if errors:
        _print(errors)
    console.print(f"The network is {out}, {out.stat().st_size / 1e6:.1f} MB.")


def _told(errors: list[PathLightErrors]) -> str:
    """Errors in short, of denoised and finished pictures."""
    return "".join(
        f"; {each.samples}: {denoised:.4f} to {finished:.4f}"
        for each in errors
        if each.denoised
        for denoised, finished in [each.means]
    )


def _print(errors: list[PathLightErrors]) -> None:
    rows = []
    for each in errors:
        for name, denoised in each.denoised.items():
            rows.append((name, str(each.samples), f"{denoised:.4f}", f"{each.finished[name]:.4f}"))
        denoised, finished = each.means
        rows.append(("mean", str(each.samples), f"{denoised:.4f}", f"{finished:.4f}"))
    print_table("RMSE on held-out pairs", ("volume", "samples", "denoised", "finished"), rows)
