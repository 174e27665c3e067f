"""The commands ``light``: pairs for, and training of, the network behind the denoiser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli import options

light = typer.Typer(
    help="The network behind the denoiser of path-traced light: pairs of pictures, and training."
)


@light.command()
def pairs(
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="What is there already stays.")
    ],
    volume: options.VolumeFiles = None,
    blocks: Annotated[
        int, typer.Option("--blocks", min=1, help="Of 8 pairs, of each volume; about 30 s each.")
    ] = 8,
    samples: Annotated[
        int, typer.Option("--samples", min=8, max=4096, help="Of what is learned.")
    ] = 64,
    seed: options.Seed = 0,
) -> None:
    """Draw pictures of few samples, and of many, for random views, TFs and lights."""
    from app.cli.path_light import draw_pairs

    draw_pairs(volume, out, blocks, seed, samples)


@light.command()
def train(
    folder: Annotated[Path, typer.Argument(metavar="PAIRS", help="Folder of 'light pairs'.")],
    out: Annotated[
        Path, typer.Option("--out", metavar="NETWORK.safetensors", help="The trained network.")
    ],
    held_out: Annotated[
        Path | None,
        typer.Option("--held-out", metavar="PAIRS", help="Pairs that errors are measured on."),
    ] = None,
    minutes: Annotated[float, typer.Option("--minutes", min=0.01, help="Of training.")] = 30.0,
    width: Annotated[
        int, typer.Option("--width", min=4, max=512, help="Channels of the first level.")
    ] = 40,
    start_from: Annotated[
        Path | None,
        typer.Option(
            "--start-from",
            metavar="NETWORK.safetensors",
            help="Begin with this network's weights and size, at a third of the rate.",
        ),
    ] = None,
    device: options.DeviceName = "auto",
    seed: options.Seed = 0,
) -> None:
    """Train the network on pairs; one that was stopped goes on."""
    from app.cli.path_light import train_network
    from model.networks.path_light_network import PathLightSize
    from model.training.path_light_training import PathLightOptions

    training = PathLightOptions(minutes, PathLightSize(width), seed=seed)
    train_network(folder, out, held_out, training, start_from, device)
