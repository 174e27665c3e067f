"""``light``: pairs for the network behind the denoiser, and its training."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from app.cli import options
from app.cli.options import option
from model.networks.names import DeviceChoice
from model.volume_files.source import VolumeSource

if TYPE_CHECKING:
    from model.training.path_light_training import PathLightErrors

commands = typer.Typer(
    help="The network behind the denoiser of path-traced light: pairs of pictures, and training."
)


@dataclass(frozen=True, kw_only=True)
class DrawPairs:
    """Draw pictures of few samples, and of many, for random views, TFs and lights."""

    out: Path = option("Folder; its files are kept.", default=options.REQUIRED, metavar="FOLDER")
    volume: list[Path] | None = option(
        "Volume file; may be repeated. (default: the shipped ones)",
        check=lambda path: VolumeSource(path=path).check(),
    )
    blocks: int = option("Groups of 8 pairs of each volume; about 30 s each.", default=8, min=1)
    samples: int = option("Samples per pixel of the target.", default=64, min=8, max=4096)
    seed: int = options.seed()

    def run(self) -> None:
        """Draw the missing pairs."""
        from app.cli.console import counting
        from model.samples.path_light_pairs import read_pairs, write_pairs
        from model.volume_files import read_volume
        from model.volume_files.shipped import shipped_volumes

        volumes = [read_volume(path) for path in self.volume or shipped_volumes()]
        written = write_pairs(self.out, volumes, self.blocks, self.seed, self.samples)
        with counting("Blocks of pairs", self.blocks * len(volumes)) as show:
            for number, _ in enumerate(written, 1):
                show(number)
        count = sum(len(each.error) for each in read_pairs(self.out).values())
        print(f"{self.out} has {count} pairs.")


@dataclass(frozen=True, kw_only=True)
class TrainPathLight:
    """Train the network on pairs; run it again to go on."""

    folder: Path = options.argument("Folder of 'light pairs'.", metavar="PAIRS")
    out: Path = option(
        "The trained network.", default=options.REQUIRED, metavar="NETWORK.safetensors"
    )
    held_out: Path | None = option("Pairs that errors are measured on.", metavar="PAIRS")
    minutes: float = option("Time of training.", default=30.0, min=0.01)
    width: int = option("Channels of the first level.", default=40, min=4, max=512)
    start_from: Path | None = option(
        "Begin with this network's weights and size, at a third of the rate.",
        metavar="NETWORK.safetensors",
    )
    device: DeviceChoice = options.device()
    seed: int = options.seed()

    def run(self) -> None:
        """Train on pairs, measure on others, and write the network with what is known about it."""
        from app.cli.console import print_table
        from model.networks import path_light_network as network
        from model.networks.blocks import choose_device
        from model.samples.path_light_pairs import read_pairs
        from model.training import path_light_training as course

        training = course.PathLightOptions(
            self.minutes, network.PathLightSize(self.width), seed=self.seed
        )
        pairs, device = read_pairs(self.folder), choose_device(self.device)
        others = read_pairs(self.held_out) if self.held_out else {}
        start = None
        if self.start_from is not None:
            known, start = network.load_path_light(self.start_from)
            training = replace(training, size=known.size, learning_rate=training.learning_rate / 3)
        trainer = course.PathLightTrainer(pairs, training, device, start)
        checkpoint = self.out.with_suffix(".training")
        if checkpoint.exists():
            trainer.resume(checkpoint)
            print(f"The training goes on after {trainer.seconds / 60:.1f} minutes.")
        count = sum(len(each.error) for each in pairs.values())
        weights = sum(weight.numel() for weight in trainer.network.parameters())
        print(f"{count} pairs of {len(pairs)} volumes; {weights:,} weights.")

        def report(loss: float) -> None:
            errors = course.path_light_errors(trainer.network, others, device)
            measured = "".join(
                "; {}: {:.4f} to {:.4f}".format(each.samples, *each.means)
                for each in errors
                if each.denoised
            )
            minutes = f"{trainer.seconds / 60:.1f} min, {trainer.steps:,} steps"
            print(f"{minutes}: loss {loss:.4f}{measured}")

        self.out.parent.mkdir(parents=True, exist_ok=True)
        trainer.run(report, checkpoint)
        errors = course.path_light_errors(trainer.network, others, device) if others else []
        measured = {str(each.samples): asdict(each) for each in errors}
        card = network.PathLightCard(
            training.size, course.described(training, trainer, count), measured
        )
        network.save_path_light(self.out, card, trainer.network)
        checkpoint.unlink(missing_ok=True)
        if errors:
            heading = ("volume", "samples", "denoised", "finished")
            print_table("RMSE on held-out pairs", heading, _rows(errors))
        print(f"The network is {self.out}, {self.out.stat().st_size / 1e6:.1f} MB.")


def _rows(errors: list[PathLightErrors]) -> list[tuple[str, ...]]:
    return [
        (name, str(each.samples), f"{denoised:.4f}", f"{finished:.4f}")
        for each in errors
        for name, denoised, finished in (
            *((name, error, each.finished[name]) for name, error in each.denoised.items()),
            ("mean", *each.means),
        )
    ]


for _name, _command in {"pairs": DrawPairs, "train": TrainPathLight}.items():
    commands.command(_name)(options.as_function(_command))
