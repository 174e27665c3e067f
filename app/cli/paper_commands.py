"""The command ``paper`` and its options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli import choices, options, values
from app.cli.paper_order import PaperOrder
from app.cli.volume_options import takes_volume
from model.scene.view import View
from model.volume_files.source import VolumeSource

FIGURE_VIEW = View(30.0, 20.0, 0.0, 0.65)
"""View of the figures: the volume fills the pictures."""


@takes_volume(placed=False)
def paper(
    *,
    item: Annotated[
        choices.PaperItem,
        typer.Argument(metavar="ITEM", help="A figure or table of the paper, or all of them."),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder of pictures and tables, and of the studies' runs.",
            callback=values.output_folder,
        ),
    ],
    model: Annotated[
        list[Path] | None,
        typer.Option(
            "--model",
            help="A model of the paper's networks; several are compared in table1, pictures show "
            "the first. (default: those that are shipped)",
            callback=values.models,
        ),
    ] = None,
    source: VolumeSource,
    view: Annotated[
        View,
        typer.Option(
            "--view",
            metavar="AZ,EL,ROLL,DIST[,X,Y]",
            help=options.VIEW_HELP,
            parser=values.view,
            show_default="30,20,0,0.65",
        ),
    ] = FIGURE_VIEW,
    tf: options.TFFile = None,
    count: Annotated[
        int | None,
        typer.Option(
            "--count",
            min=8,
            help="Hold-out samples. (default: 2000 for table1, 200 for pictures, 500 for studies)",
        ),
    ] = None,
    dataset: Annotated[
        Path | None,
        typer.Option(
            "--dataset",
            metavar="STORE",
            help="Samples of the model's volume, made with 'dataset': table1 measures models on "
            "them, with the nearest training image, and has their time. (default: each model's "
            "own are rendered)",
            callback=values.store,
        ),
    ] = None,
    minutes: Annotated[
        float, typer.Option("--minutes", min=0.01, help="Training of each model of a study.")
    ] = 20.0,
    quick: Annotated[
        bool,
        typer.Option("--quick", help="Few samples and steps: shows that all works, in minutes."),
    ] = False,
    workers: options.Workers = None,
    device: options.DeviceName = "auto",
) -> None:
    """Make the paper's figures and tables anew, from a trained model or small studies."""
    # Late: with it comes torch.
    from app.cli.paper import make_items

    make_items(
        PaperOrder(
            item=item, out=out, models=tuple(model or ()), volume=source, view=view, tf=tf,
            count=count, dataset=dataset, minutes=minutes, quick=quick, workers=workers,
            device=device,
        )
    )  # fmt: skip
