"""The commands, and the window, which is opened without one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from app.cli import choices, image_commands, model_commands, options
from app.cli.bench_commands import bench
from app.cli.latent_commands import codec, latent
from model.errors import TfscopeError

application = typer.Typer(
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Look into volumes through transfer functions, beside a generative model.",
)

application.add_typer(bench, name="bench")
for command in (
    image_commands.info,
    image_commands.render,
    image_commands.sensitivity,
    latent,
    model_commands.dataset,
    model_commands.train,
    model_commands.evaluate,
    model_commands.study,
    codec,
):
    application.command()(command)


@application.callback(invoke_without_command=True)
def window(
    context: typer.Context,
    model: options.ModelFolder = None,
    volume: options.VolumeFile = None,
    device: options.DeviceName = choices.Device.AUTO,
    backend: options.BackendName = choices.BackendOption.AUTO,
    precision: options.PrecisionName = choices.PrecisionOption.FLOAT32,
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

        code = open_window(volume, model, str(device), str(backend), str(precision), screenshot)
        raise typer.Exit(code)
    automatic = (choices.Device.AUTO, choices.BackendOption.AUTO, choices.PrecisionOption.FLOAT32)
    if model or volume or screenshot or (device, backend, precision) != automatic:
        command = context.invoked_subcommand
        raise TfscopeError(f"Options before '{command}' are the window's; put them behind it.")
