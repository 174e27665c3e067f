"""The command ``latent`` and its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

import typer

from app.cli import options, values
from app.cli.latent_order import Brush, LatentOrder, Place
from app.cli.volume_options import takes_volume
from model.volume_files.source import VolumeSource


@takes_volume()
def latent(
    *,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="OUT",
            help="OUT.npz: all arrays, OUT.png: a figure, OUT.json: the TF at --at or --near.",
            callback=values.output(".npz", ".png", ".json"),
        ),
    ],
    source: VolumeSource,
    model: Annotated[
        Path | None,
        typer.Option(
            "--model",
            help="Take this model's codec and pictures, not tfscope's and exact ones.",
            callback=values.model,
        ),
    ] = None,
    grid: Annotated[
        str | None,
        typer.Option(
            "--grid", metavar="X0,Y0,X1,Y1", help="Pictures of this rectangle's 4 x 4 cells."
        ),
    ] = None,
    at: Annotated[
        str | None,
        typer.Option("--at", metavar="X,Y", help="The TF interpolated at a place of the map."),
    ] = None,
    near: Annotated[
        Path | None,
        typer.Option(
            "--near",
            metavar="TF.json",
            help="The place of this TF, and its code's TF.",
            callback=values.tf,
        ),
    ] = None,
    view: options.ViewNumbers = values.HOME_VIEW,
    tf: Annotated[
        Path | None,
        typer.Option(
            "--tf",
            metavar="TF.json",
            help="Its colours. (default: the volume's)",
            callback=values.tf,
        ),
    ] = None,
    size: Annotated[
        int,
        typer.Option("--size", min=16, max=1024, help="Pixels; a model has its own size."),
    ] = 128,
) -> None:
    """Map opacity TFs by their latent codes, and draw what its parts show."""
    order = LatentOrder(
        source,
        model,
        cast(Brush | None, values.numbers(grid, 4, "--grid")),
        cast(Place | None, values.numbers(at, 2, "--at")),
        near,
        view,
        tf,
        size,
        out,
    )
    # Late: with it comes torch.
    from app.cli.latent import save_latent

    save_latent(order)
