"""The commands, and the window, which is opened without one."""

from __future__ import annotations

from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

from app.cli import choices, image_commands, model_commands, options, values
from app.cli.desktop_entry import desktop_entry
from app.cli.latent_commands import latent
from app.cli.paper_commands import paper
from app.cli.path_light_commands import light
from app.state.window_start import WindowStart
from model.errors import TfscopeError
from model.scene.range_choice import RangeChoice
from model.scene.scene import Lighting
from model.scene.view import View
from model.volume_files.choice import Choice

application = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Look into volumes through transfer functions, beside a generative model.",
)

application.add_typer(light, name="light")
for command in (
    image_commands.info,
    image_commands.render,
    image_commands.sensitivity,
    latent,
    model_commands.dataset,
    model_commands.train,
    model_commands.evaluate,
    model_commands.study,
    paper,
    desktop_entry,
):
    application.command()(command)


def _print_version(is_wanted: bool) -> None:
    if is_wanted:
        typer.echo(f"tfscope {version('tfscope')}")
        raise typer.Exit()


@application.callback(
    invoke_without_command=True,
    subcommand_metavar="[FILE] | COMMAND [ARGS]...",
)
def window(
    context: typer.Context,
    model: options.ModelFolder = None,
    volume: options.VolumeFile = None,
    tf: options.TFFile = None,
    session: Annotated[
        Path | None,
        typer.Option(
            "--session",
            metavar="FILE.tfscope",
            help="What 'File > Save session' wrote; --volume: where its volume is now.",
        ),
    ] = None,
    view: Annotated[
        View | None,
        typer.Option(
            "--view", metavar="AZ,EL,ROLL,DIST[,X,Y]", help=options.VIEW_HELP, parser=values.view
        ),
    ] = None,
    lighting: Annotated[
        Lighting | None,
        typer.Option("--lighting", help="Of the reference image. (default: as last time)"),
    ] = None,
    light: options.LightAngles = None,
    renderer: Annotated[
        choices.ReferenceRenderer | None,
        typer.Option(
            "--renderer",
            help="Of the reference image; auto: the ray caster while anything moves, and where no "
            "graphics card draws, VTK otherwise. (default: as last time)",
        ),
    ] = None,
    scalar_range: options.ScalarRange = None,
    scale: options.ScaleName = None,
    series: options.SeriesName = None,
    array: options.ArrayName = None,
    time: options.TimeName = None,
    channel: options.ChannelName = None,
    component: options.ComponentName = None,
    crop: options.CropPlanes = None,
    device: options.DeviceName = "auto",
    screenshot: Annotated[
        Path | None,
        typer.Option(
            "--screenshot",
            metavar="OUT.png",
            help="Open the window off screen, save its picture and exit.",
            callback=values.output(".png"),
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option("--size", metavar="WxH", help="Width and height of the window in pixels."),
    ] = None,
    _version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", callback=_print_version),
    ] = False,
) -> None:
    """Look into volumes through transfer functions, beside a generative model.

    FILE is opened in the window: a volume, a model's folder, a TF file, or a session.
    """
    if context.invoked_subcommand is None:
        from app.cli.window import open_window, window_volume

        choice = Choice(series, array, time, channel, component)
        start = WindowStart(
            volume=window_volume(volume, model, session),
            model=model,
            tf=tf,
            view=view,
            lighting=lighting,
            light=light,
            renderer=renderer,
            scalar_range=None if scalar_range is None else RangeChoice.parse(scalar_range),
            scale=scale,
            crop=crop,
            size=values.window_size(size),
            choice=choice if choice.text else None,
            session=session,
        )
        code = open_window(start, device, screenshot)
        raise typer.Exit(code)
    given = [
        name
        for name in context.params
        if str(context.get_parameter_source(name)).endswith("COMMANDLINE")
    ]
    if given:
        command = context.invoked_subcommand
        raise TfscopeError(f"Options before '{command}' are the window's; put them behind it.")
