"""``light``: pairs for the network behind the denoiser, and its training."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path

from app.cli.console import console, counting, print_table
from app.cli.outputs import write_json
from model.devices import choose_device
from model.errors import TrainingError
from model.evaluation.path_light_alternatives import path_light_alternatives
from model.generator.catalog import PATH_LIGHT
from model.networks.names import PathLightLoss
from model.networks.path_light_file import PathLightCard, load_path_light, save_path_light
from model.networks.path_light_network import PathLightNetwork, PathLightSize
from model.samples.path_light_pairs import FEW, read_pairs, write_pairs
from model.training.path_light_losses import PATH_LIGHT_LOSSES
from model.training.path_light_training import (
    PathLightErrors,
    PathLightOptions,
    PathLightTrainer,
    described,
    path_light_errors,
)
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes


def draw_pairs(
    paths: list[Path] | None, out: Path, blocks: int, seed: int, samples: int, largest: int
) -> None:
    """Draw pairs of the volumes that are not there yet."""
    volumes = [read_volume(path) for path in paths or shipped_volumes()]
    with counting("Blocks of pairs", blocks * len(volumes)) as (progress, task):
        for _ in write_pairs(out, volumes, blocks, seed, samples, largest):
            progress.advance(task)
    count = sum(len(each.error) for each in read_pairs(out).values())
    console.print(f"{out} has {count} pairs.")


def path_light_options(
    minutes: float, steps: int | None, width: int, seed: int, loss: PathLightLoss = "rms"
) -> PathLightOptions:
    """Return how networks are trained."""
    return PathLightOptions(minutes, PathLightSize(width), seed=seed, loss=loss, steps=steps)


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


def study_networks(
    folder: Path, held_out: Path, out: Path, training: PathLightOptions, device: str
) -> None:
    """Train a network by each loss, or what is missing of it, and compare all of them."""
    networks: dict[str, PathLightNetwork] = {}
    budget = "minutes" if training.steps is None else "steps"
    for loss in PATH_LIGHT_LOSSES:
        path = out / f"{loss}.safetensors"
        if not path.exists():
            console.print(f"Loss {loss}:")
            train_network(folder, path, None, replace(training, loss=loss), None, device)
        card, networks[f"finished, trained by {loss}"] = load_path_light(path)
        if card.training.get(budget) != getattr(training, budget):
            raise TrainingError(
                f"{path}: this network is trained with another budget; give the same, or choose "
                "another folder."
            )
    _compare(networks, held_out, folder, device, out / "study.json")


def evaluate_network(
    held_out: Path, network: Path | None, trained: Path | None, device: str, json_path: Path | None
) -> None:
    """Measure a network and its alternatives; print a table, write JSON if requested."""
    _card, loaded = load_path_light(network or PATH_LIGHT)
    _compare({"finished": loaded}, held_out, trained, device, json_path)


def _compare(
    networks: dict[str, PathLightNetwork],
    held_out: Path,
    trained: Path | None,
    device: str,
    json_path: Path | None,
) -> None:
    """Measure networks and what could be shown in their place, and tell it."""
    others = read_pairs(held_out)
    learned = read_pairs(trained) if trained else {}
    found = path_light_alternatives(networks, others, learned, choose_device(device))
    count = sum(len(each.error) for each in others.values())
    print_table(
        f"RMSE on {count} pairs of {len(others)} volumes, after so many samples of each pixel",
        ("shown", *map(str, FEW)),
        [(each.name, *(f"{error:.4f}" for error in each.errors)) for each in found],
    )
    if json_path is not None:
        rows = {each.name: each.errors for each in found}
        write_json(json_path, {"samples": FEW, "pairs": count, "rmse": rows})


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
