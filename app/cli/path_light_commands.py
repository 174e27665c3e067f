"""The commands ``light``: pairs for, and training of, the network behind the denoiser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli import options
from model.networks.names import PathLightLoss

Minutes = Annotated[float, typer.Option("--minutes", min=0.01, help="Of training of each network.")]
Steps = Annotated[
    int | None,
    typer.Option(
        "--steps",
        min=1,
        help="Of training of each network, in place of minutes: networks with as many can be "
        "compared, however busy the machine was.",
    ),
]
Width = Annotated[int, typer.Option("--width", min=4, max=512, help="Channels of the first level.")]

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
    largest: Annotated[
        int,
        typer.Option(
            "--largest", min=1, max=16, help="Parts of pictures up to so many times as large."
        ),
    ] = 3,
    seed: options.Seed = 0,
) -> None:
    """Draw pictures of few samples, and of many, for random views, TFs and lights."""
    from app.cli.path_light import draw_pairs

    draw_pairs(volume, out, blocks, seed, samples, largest)


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
    minutes: Minutes = 30.0,
    steps: Steps = None,
    width: Width = 40,
    start_from: Annotated[
        Path | None,
        typer.Option(
            "--start-from",
            metavar="NETWORK.safetensors",
            help="Begin with this network's weights and size, at a third of the rate.",
        ),
    ] = None,
    loss: Annotated[
        PathLightLoss,
        typer.Option(
            "--loss",
            help="rms: root mean square of each picture's difference; l1: mean absolute "
            "difference; gan-l1: that and the paper's adversary.",
        ),
    ] = "rms",
    device: options.DeviceName = "auto",
    seed: options.Seed = 0,
) -> None:
    """Train the network on pairs; one that was stopped goes on."""
    from app.cli.path_light import path_light_options, train_network

    training = path_light_options(minutes, steps, width, seed, loss)
    train_network(folder, out, held_out, training, start_from, device)
