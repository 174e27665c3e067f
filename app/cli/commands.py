"""All commands, and the window, which opens if no command is given."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import Literal

import typer
from typer.core import TyperGroup

from app.cli import options, path_light, values
from app.cli.dataset import Dataset
from app.cli.evaluate import Evaluate
from app.cli.info import Info
from app.cli.latent import Latent
from app.cli.options import option
from app.cli.paper import Paper, Study
from app.cli.render import Render
from app.cli.sensitivity import Sensitivity
from app.cli.train import Train
from app.state.window_start import WindowStart
from model.errors import TfscopeError
from model.generator.catalog import volume_for
from model.networks.card import MODEL_FILE
from model.networks.names import DeviceChoice
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.ranges import RangeChoice
from model.scene.scene import LightDirection, Lighting, RendererName
from model.scene.view import View
from model.volume_files import Choice
from model.volume_files.shipped import SCAN
from model.volume_files.source import VolumeSource

application = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
application.add_typer(path_light.commands, name="light")
for command in (Info, Render, Sensitivity, Latent, Dataset, Train, Evaluate, Study, Paper):
    application.command(command.__name__.lower())(options.as_function(command))


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
        "A session that 'File > Save session' wrote. --volume says where its volume is now.",
        metavar="FILE.tfscope",
    )
    view: View | None = options.view(default=None, show_default=False)
    lighting: Lighting | None = option("Light of the reference. (default: as last time)")
    light: LightDirection | None = options.light()
    renderer: Literal["auto", RendererName] | None = option(
        "Renderer of the reference image; auto: the ray caster while anything moves and where no "
        "graphics card draws, else VTK. (default: as last time)"
    )
    crop: CropBox | None = options.crop()
    clip: ClipPlane | None = options.clip()
    device: DeviceChoice = options.device()
    screenshot: Path | None = options.output(
        "Open the window off screen, save its picture and exit.",
        ".png",
        default=None,
        metavar="OUT.png",
    )
    size: tuple[int, int] | None = option(
        "Width and height of the window in pixels.", metavar="WxH", parser=values.window_size
    )
    version: bool = option("Print the version and exit.", default=False, callback=_print_version)

    def run(self) -> None:
        """Open the window, unless a command is given; options before a command are refused."""
        command = self.context.invoked_subcommand
        if command is None:
            raise typer.Exit(open_window(self._start(), self.device, self.screenshot))
        for name in self.context.params:
            if str(self.context.get_parameter_source(name)).endswith("COMMANDLINE"):
                raise TfscopeError(
                    f"Options before '{command}' apply to the window; put them after it."
                )

    def _start(self) -> WindowStart:
        source, own = self.source, options.same_named(self, WindowStart)
        own["volume"] = source.path or self._default_volume()
        own["choice"] = Choice.parse(source.text) if source.text else None
        if source.scalar_range is not None:
            own["scalar_range"] = RangeChoice.parse(source.scalar_range)
        return WindowStart(**own, scale=source.scale)

    def _default_volume(self) -> Path:
        """The session's volume, or the model's if that is shipped, or the default."""
        if self.session is None:
            return (None if self.model is None else volume_for(self.model)) or SCAN
        # Imported here: only sessions need it.
        from app.state.session import Session

        found = Session.load(self.session).volume
        if not found.exists():
            raise TfscopeError(
                f"{self.session} shows {found}, which no longer exists; "
                "give its new place by --volume."
            )
        return found


def open_window(start: WindowStart, device: str, screenshot: Path | None) -> int:
    """Open the window and return its exit code."""
    import gc

    from app.cli.outputs import make_room_for
    from app.quick_imports import leave_sources_unread

    leave_sources_unread()
    # Collecting garbage during the imports takes time and frees nothing.
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

OPTIONS = {".json": "--tf", ".tfscope": "--session", ".png": "--session"}  # by the suffix of a file


def with_options_for_files(arguments: Sequence[str], application: TyperGroup) -> list[str]:
    """Add the option to each file that is given without one."""
    options = {
        flag: parameter
        for parameter in application.params
        for flag in (*parameter.opts, *parameter.secondary_opts)
    }
    found: list[str] = []
    given: dict[str, str] = {}
    words = iter(arguments)
    for word in words:
        if word.startswith("-"):
            found.append(word)
            option = options.get(word)
            # The next word is the option's value, even if it begins with "-".
            if option is not None and not getattr(option, "is_flag", False):
                found += islice(words, 1)
            continue
        if word in application.commands:
            return [*found, word, *words]
        option_name = _option_for(word, application)
        if option_name in given:
            raise TfscopeError(
                f"{given[option_name]} and {word} cannot both be opened by {option_name}; give one."
            )
        given[option_name] = word
        found += [option_name, word]
    return found


def _option_for(word: str, application: TyperGroup) -> str:
    path = Path(word)
    if not path.exists():
        commands = ", ".join(sorted(application.commands))
        raise TfscopeError(
            f"'{word}' is neither a command ({commands}) nor an existing file or folder. "
            "See --help."
        )
    if path.is_dir():
        return "--model" if (path / MODEL_FILE).exists() else "--volume"
    return OPTIONS.get(path.suffix.lower(), "--volume")
