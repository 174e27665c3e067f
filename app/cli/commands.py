"""The commands and their options. What they do is in one module each."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli import options
from model.errors import TfscopeError

application = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Look into volumes through transfer functions, beside a generative model.",
)


@application.callback(invoke_without_command=True)
def window(
    context: typer.Context,
    model: options.ModelFolder = None,
    volume: options.VolumeFile = None,
    device: options.DeviceName = options.Device.AUTO,
    screenshot: Annotated[
        Path | None,
        typer.Option(
            "--screenshot",
            metavar="OUT.png",
            help="Open the window off screen, save its picture and exit.",
        ),
    ] = None,
) -> None:
    """Look into volumes through transfer functions, beside a generative model."""
    if context.invoked_subcommand is None:
        from app.cli.window import open_window

        raise typer.Exit(open_window(volume, model, str(device), screenshot))
    if model or volume or screenshot or device != options.Device.AUTO:
        command = context.invoked_subcommand
        raise TfscopeError(f"Options before '{command}' are the window's; put them behind it.")


@application.command()
def info(
    path: Annotated[Path, typer.Argument(metavar="FILE_OR_MODEL", help="A volume or a model.")],
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
) -> None:
    """Print what a volume file or a model folder holds."""
    from app.cli.info import print_info

    print_info(options.VolumeSource(path, raw, component))


@application.command()
def render(
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="OUT", help="OUT.png on black, or OUT.npy: float32 RGBA (H, W, 4)."
        ),
    ],
    renderer: Annotated[
        options.Renderer, typer.Option("--renderer", help="The reference or the trained model.")
    ] = options.Renderer.VTK,
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    model: options.ModelFolder = None,
    view: Annotated[
        str,
        typer.Option(
            "--view",
            metavar="AZ,EL,ROLL,DIST",
            help="Degrees, and the distance in units of the one at which the whole volume is in "
            "view: 1 is the farthest that models are trained for, 0.4 the nearest.",
        ),
    ] = "30,20,0,1",
    tf: Annotated[
        Path | None,
        typer.Option("--tf", metavar="TF.json", help="Transfer function. [default: from the data]"),
    ] = None,
    lighting: Annotated[
        options.LightingOption | None,
        typer.Option("--lighting", help="For VTK. [default: the model's, or none]"),
    ] = None,
    size: Annotated[
        int | None,
        typer.Option(
            "--size", min=16, max=4096, help="Pixels. [default: the model's, or 256 for VTK]"
        ),
    ] = None,
    device: options.DeviceName = options.Device.AUTO,
) -> None:
    """Render one image to a file."""
    from app.cli.render import RenderOrder, render_to_file

    render_to_file(
        RenderOrder(
            renderer=str(renderer),
            volume=options.VolumeSource(volume, raw, component),
            model=model,
            view=view,
            tf=tf,
            lighting=lighting,
            size=size,
            device=str(device),
            out=out,
        )
    )


@application.command()
def dataset(
    out: Annotated[Path, typer.Option("--out", metavar="STORE", help="Zarr folder.")],
    count: Annotated[int, typer.Option("--count", min=1, help="Number of training samples.")],
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    size: Annotated[
        int, typer.Option("--size", min=16, max=4096, help="Width and height in pixels.")
    ] = 256,
    seed: options.Seed = 0,
    lighting: options.LightingName = options.LightingOption.NONE,
    window: options.Window = None,
    holdout: Annotated[
        int | None,
        typer.Option("--holdout", min=1, help="Hold-out samples. [default: a tenth, at most 2000]"),
    ] = None,
    workers: options.Workers = None,
) -> None:
    """Render random samples into a store; run it again to go on or to add more."""
    from app.cli.dataset import make_dataset

    source = options.VolumeSource(volume, raw, component)
    make_dataset(source, out, count, holdout, size, seed, lighting, window, workers)


@application.command()
def train(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder of run and model.")],
    preset: Annotated[
        options.Preset,
        typer.Option("--preset", help="64 x 64, 128 x 128 for CPUs, or the paper's 256 x 256."),
    ] = options.Preset.COMPACT,
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    store: Annotated[
        Path | None,
        typer.Option(
            "--dataset",
            metavar="STORE",
            help="Samples made with 'dataset'. [default: rendered first, in a quarter of the time]",
        ),
    ] = None,
    minutes: Annotated[float | None, typer.Option("--minutes", help="Budget in minutes.")] = None,
    samples: Annotated[
        int | None, typer.Option("--samples", help="Budget in samples seen, over both stages.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with the run in --out.")] = False,
    faithful: Annotated[
        bool, typer.Option("--faithful", help="The paper's recipe, nothing added.")
    ] = False,
    opacity_l1: Annotated[
        float | None, typer.Option("--opacity-l1", min=0, help="Weight of l1 on opacity images.")
    ] = None,
    predicted_share: Annotated[
        float | None,
        typer.Option(
            "--predicted-share",
            min=0,
            max=1,
            help="Share of stage 2's opacity images that stage 1 predicts.",
        ),
    ] = None,
    average_decay: Annotated[
        float | None,
        typer.Option("--average-decay", min=0, help="Decay of the weight average; 0 is none."),
    ] = None,
    adversarial_start: Annotated[
        float | None,
        typer.Option(
            "--adversarial-start",
            min=0,
            max=1,
            help="Share of each stage after which the discriminator joins; 1 is never.",
        ),
    ] = None,
    lighting: options.LightingName = options.LightingOption.NONE,
    window: options.Window = None,
    seed: options.Seed = 0,
    workers: options.Workers = None,
    device: options.DeviceName = options.Device.AUTO,
) -> None:
    """Train a generator of one volume's renderings."""
    from app.cli.train import TrainOrder, train_model

    train_model(
        TrainOrder(
            volume=options.VolumeSource(volume, raw, component),
            store=store,
            preset=str(preset),
            out=out,
            minutes=minutes,
            samples=samples,
            resume=resume,
            faithful=faithful,
            overrides={
                "opacity_l1_weight": opacity_l1,
                "predicted_share": predicted_share,
                "average_decay": average_decay,
                "adversarial_start": adversarial_start,
            },
            lighting=options.lighting(lighting),
            window=options.parse_window(window),
            seed=seed,
            workers=workers,
            device=str(device),
        )
    )


@application.command()
def evaluate(
    model: Annotated[Path, typer.Option("--model", help="Folder of a trained model.")],
    count: Annotated[int, typer.Option("--count", min=1, help="Hold-out samples.")] = 200,
    volume: options.VolumeFile = None,
    raw: options.RawLayoutText = None,
    component: options.ComponentName = None,
    store: Annotated[
        Path | None,
        typer.Option(
            "--dataset",
            metavar="STORE",
            help="The model's samples. [default: those in its folder, or rendered anew]",
        ),
    ] = None,
    neighbours: Annotated[
        int, typer.Option("--neighbours", min=1, help="Training images to look up, if rendered.")
    ] = 2000,
    json: Annotated[
        Path | None, typer.Option("--json", metavar="OUT.json", help="Also write the result.")
    ] = None,
    device: options.DeviceName = options.Device.AUTO,
    workers: options.Workers = None,
) -> None:
    """Measure a model on hold-out samples, beside the nearest training image."""
    from app.cli.evaluate import evaluate_model

    source = options.VolumeSource(volume, raw, component)
    evaluate_model(model, count, source, store, neighbours, json, str(device), workers)
