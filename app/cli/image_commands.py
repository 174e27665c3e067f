"""The commands ``info``, ``render`` and ``sensitivity`` and their options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli import choices, options, values
from app.cli.volume_options import takes_volume
from model.scene.scene import Lighting
from model.scene.view import View
from model.sensitivity.display import Measure
from model.volume_files.source import VolumeSource

FILE_OR_MODEL = Annotated[
    Path,
    typer.Argument(metavar="FILE_OR_MODEL", help="A volume or a model.", callback=values.volume),
]


@takes_volume(placed=False, argument=FILE_OR_MODEL)
def info(
    *,
    source: VolumeSource,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print it as JSON, for programs.")
    ] = False,
) -> None:
    """Print what a volume file or a model folder holds."""
    from app.cli.info import print_info

    print_info(source, as_json)


@takes_volume()
def render(
    *,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="OUT",
            help="OUT.png, OUT.mp4 or OUT.gif: a full turn about the up axis, or OUT.npy: float32 "
            "RGBA (H, W, 4).",
            callback=values.output(".png", ".mp4", ".gif", ".npy"),
        ),
    ],
    renderer: Annotated[
        choices.Renderer,
        typer.Option(
            "--renderer",
            help="The reference, the fast ray caster, or the model.",
        ),
    ] = "vtk",
    source: VolumeSource,
    model: options.ModelFolder = None,
    session: Annotated[
        Path | None,
        typer.Option(
            "--session",
            metavar="NAME.tfscope",
            help="What 'File > Save session' wrote: its volume, view, TF, light and crop box, "
            "unless other options say so.",
        ),
    ] = None,
    view: Annotated[
        View | None,
        typer.Option(
            "--view",
            metavar="AZ,EL,ROLL,DIST[,X,Y]",
            parser=values.view,
            help=options.VIEW_HELP + " (default: the session's, or 30,20,0,1)",
        ),
    ] = None,
    tf: options.TFFile = None,
    lighting: Annotated[
        Lighting | None,
        typer.Option("--lighting", help="For VTK and ray caster. (default: the model's, or none)"),
    ] = None,
    light: options.LightAngles = None,
    crop: options.CropPlanes = None,
    samples: Annotated[
        int | None,
        typer.Option(
            "--samples",
            min=1,
            max=1 << 20,
            help="Of each pixel in path-traced light: four times as many halve the noise. "
            "(default: 64; with --error as many as it takes)",
        ),
    ] = None,
    error: Annotated[
        float | None,
        typer.Option(
            "--error",
            min=1e-4,
            max=1.0,
            help="Estimated error (RMSE) of path-traced light that is good enough: as many samples "
            "as it takes, at most --samples.",
        ),
    ] = None,
    denoise: Annotated[
        bool | None,
        typer.Option(
            "--denoise/--no-denoise",
            help="Whether Intel's Open Image Denoise cleans path-traced pictures as long as that "
            "brings them nearer to the truth. (default: where it is installed)",
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option("--size", metavar="N or WxH", help="Pixels. (default: the model's, or 256)"),
    ] = None,
    background: Annotated[
        str,
        typer.Option(
            "--background",
            metavar="COLOUR",
            help="Of a picture or movie: black, white, transparent or #rrggbb.",
        ),
    ] = "black",
    legend: Annotated[
        bool, typer.Option("--legend", help="Paint the colour legend into a picture or movie.")
    ] = False,
    scale_bar: Annotated[
        bool,
        typer.Option(
            "--scale-bar",
            help="Paint a scale bar. Its length holds in the plane through the middle of what is "
            "shown.",
        ),
    ] = False,
    seconds: Annotated[
        float, typer.Option("--seconds", min=0.5, max=600, help="Length of a movie.")
    ] = 8.0,
    rate: Annotated[
        int, typer.Option("--rate", min=1, max=60, help="Pictures a second of a movie.")
    ] = 25,
    brightness: Annotated[
        float | None,
        typer.Option(
            "--brightness",
            min=0.25,
            max=32.0,
            help="Of a PNG, as in the window. (default: 1; lit images, which are dim, 2)",
        ),
    ] = None,
    missing: Annotated[
        bool,
        typer.Option(
            "--draw-missing",
            help="Draw voxels of which the file says that nothing was measured there.",
        ),
    ] = False,
    sample_distance: Annotated[
        float | None,
        typer.Option(
            "--sample-distance",
            metavar="VOXELS",
            min=0.01,
            max=10.0,
            help="Between samples along a ray. At .1 the ray caster shows no rings on thin layers, "
            "as in the window. (default: .5, or the model's)",
        ),
    ] = None,
    device: options.DeviceName = "auto",
) -> None:
    """Render one image, or a movie of a full turn, to a file."""
    from app.cli.render import render_to_file
    from app.cli.render_order import RenderOrder

    order = RenderOrder(
        renderer=renderer,
        volume=source,
        model=model,
        view=view or values.HOME_VIEW,
        tf=tf,
        lighting=lighting,
        samples=samples,
        error=error,
        denoise=denoise,
        light=light,
        crop=crop,
        size=values.pixels(size),
        background=values.background(background),
        legend=legend,
        scale_bar=scale_bar,
        seconds=seconds,
        rate=rate,
        brightness=brightness,
        draws_missing=missing,
        sample_distance=sample_distance,
        device=device,
        out=out,
    )
    if session is not None:
        from app.cli.session_order import of_session

        order = of_session(order, session, has_view=view is not None)
    render_to_file(order)


@takes_volume()
def sensitivity(
    *,
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="OUT",
            help="OUT.npz or OUT.csv: all numbers, OUT.png: a figure.",
            callback=values.output(".png", ".npz", ".csv"),
        ),
    ],
    model: options.ModelFolder = None,
    source: VolumeSource,
    engine: Annotated[
        choices.SensitivityEngine | None,
        typer.Option(
            "--engine",
            help="The ray caster's own derivative, the generator's, or the generator's block by "
            "block, as in the paper. (default: learned with --model, else exact)",
        ),
    ] = None,
    view: options.ViewNumbers = values.HOME_VIEW,
    tf: options.TFFile = None,
    lighting: Annotated[
        Lighting | None,
        typer.Option("--lighting", help="Of the ray caster's image."),
    ] = None,
    size: Annotated[
        int | None,
        typer.Option(
            "--size", min=16, max=4096, help="Pixels of the rendering; a model has its own size."
        ),
    ] = None,
    region: options.RegionEdges = None,
    crop: options.CropPlanes = None,
    value: Annotated[
        float | None,
        typer.Option("--value", help="Where in the image does this scalar value show?"),
    ] = None,
    block: Annotated[
        int | None,
        typer.Option(
            "--block", min=1, help="All blocks of this many pixels, to edits at all values."
        ),
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            "--width",
            min=0,
            help="Standard deviation of the edits, in the data's units; 0 for single samples of "
            "the TF. (default: 6 of 256 samples)",
        ),
    ] = None,
    measure: Annotated[
        Measure,
        typer.Option(
            "--measure",
            help="signed: the change of brightness, as in the paper; change: the size of the "
            "change, also where the picture is black.",
        ),
    ] = "signed",
    field_scale: Annotated[
        choices.FieldScale,
        typer.Option(
            "--field-scale",
            help="Of a value's figure. own: colours by its field; global: by the fields of all "
            "values, and opacity by its own, as in the paper.",
        ),
    ] = "own",
    device: options.DeviceName = "auto",
) -> None:
    """Find where in the TF an edit changes a region, or where in the image an edit shows."""
    from app.cli.sensitivity import save_sensitivity
    from app.cli.sensitivity_order import SensitivityOrder

    save_sensitivity(
        SensitivityOrder(
            volume=source,
            model=model,
            engine=engine,
            view=view,
            tf=tf,
            size=size,
            region=region,
            crop=crop,
            value=value,
            block=block,
            width=width,
            measure=measure,
            lighting=lighting,
            device=device,
            out=out,
            by_all_values=field_scale == "global",
        )
    )
