"""The commands, and the window, which is opened without one."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Literal

import typer

from app.cli import options, path_light, values
from app.cli.dataset import Dataset
from app.cli.desktop_entry import DesktopEntry
from app.cli.evaluate import Evaluate
from app.cli.info import Info
from app.cli.latent import Latent
from app.cli.options import option
from app.cli.paper import Paper
from app.cli.render import Render
from app.cli.sensitivity import Sensitivity
from app.cli.study import Study
from app.cli.train import Train
from app.state.window_start import WindowStart
from model.errors import TfscopeError
from model.generator.catalog import volume_for
from model.networks.names import DeviceChoice
from model.scene.crop import CropBox
from model.scene.light import LightDirection
from model.scene.ranges import RangeChoice
from model.scene.scene import Lighting, RendererName
from model.scene.view import View
from model.volume_files.shipped import SCAN
from model.volume_files.source import VolumeSource

COMMANDS = {
    "info": Info,
    "render": Render,
    "sensitivity": Sensitivity,
    "latent": Latent,
    "dataset": Dataset,
    "train": Train,
    "evaluate": Evaluate,
    "study": Study,
    "paper": Paper,
    "desktop-entry": DesktopEntry,
}

application = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
application.add_typer(path_light.commands, name="light")
for name, command in COMMANDS.items():
    application.command(name)(options.as_function(command))


def _print_version(is_wanted: bool) -> None:
    if is_wanted:
        typer.echo(f"tfscope {version('tfscope')}")
        raise typer.Exit()


@dataclass(frozen=True, kw_only=True)
class Window:
    """Look into volumes through transfer functions, with a generative model of their renderings.

    FILE is opened in the window: a volume, a model's folder, a TF file, or a session.
    """

    context: typer.Context
    model: Path | None = options.model()
    source: VolumeSource = options.volume("raw")
    tf: Path | None = options.tf()
    session: Path | None = option(
        None,
        "What 'File > Save session' wrote; --volume: where its volume is now.",
        metavar="FILE.tfscope",
    )
    view: View | None = options.view(default=None, show_default=False)
    lighting: Lighting | None = option(None, "Of the reference image. (default: as last time)")
    light: LightDirection | None = options.light()
    renderer: Literal["auto", RendererName] | None = option(
        None,
        "Of the reference image; auto: the ray caster while anything moves, and where no "
        "graphics card draws, VTK otherwise. (default: as last time)",
    )
    crop: CropBox | None = options.crop()
    device: DeviceChoice = options.device()
    screenshot: Path | None = options.output(
        "Open the window off screen, save its picture and exit.",
        ".png",
        default=None,
        metavar="OUT.png",
    )
    size: tuple[int, int] | None = option(
        None, "Width and height of the window in pixels.", metavar="WxH", parser=values.window_size
    )
    version: bool = option(False, "Print the version and exit.", callback=_print_version)

    def run(self) -> None:
        """Open the window, unless there is a command; then there must be no options."""
        command = self.context.invoked_subcommand
        if command is None:
            raise typer.Exit(open_window(self._start(), self.device, self.screenshot))
        for name in self.context.params:
            if str(self.context.get_parameter_source(name)).endswith("COMMANDLINE"):
                raise TfscopeError(
                    f"Options before '{command}' are the window's; put them behind it."
                )

    def _start(self) -> WindowStart:
        source = self.source
        choice = source.choice
        typed = source.scalar_range
        own = options.same_named(self, WindowStart)
        own["volume"] = source.path or self._default_volume()
        own["choice"] = choice if choice.text else None
        own["scalar_range"] = None if typed is None else RangeChoice.parse(typed)
        return WindowStart(**own, scale=source.scale)

    def _default_volume(self) -> Path:
        """The session's volume, or the model's if that is shipped, or the default."""
        if self.session is None:
            return (None if self.model is None else volume_for(self.model)) or SCAN
        # Imported here: who opens no session starts without it.
        from app.state.session import Session

        found = Session.load(self.session).volume
        if not found.exists():
            raise TfscopeError(
                f"{self.session} shows {found}, which is not there any more; "
                "give its new place by --volume."
            )
        return found


def open_window(start: WindowStart, device: str, screenshot: Path | None) -> int:
    """Open the window and return its exit code."""
    import gc

    from app.cli.outputs import make_room_for
    from app.quick_imports import leave_sources_unread

    leave_sources_unread()
    # The modules that are imported now stay: looking through them again and again takes time.
    gc.disable()
    try:
        from app.launch import run_window

        if screenshot is not None:
            make_room_for(screenshot)
        return run_window(start, device, screenshot)
    finally:
        gc.enable()


application.callback(invoke_without_command=True, subcommand_metavar="[FILE] | COMMAND [ARGS]...")(
    options.as_function(Window)
)
