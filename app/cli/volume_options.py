"""Options that say which volume a command reads, declared once for all commands."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

from app.cli import options, values

READING: dict[str, Any] = {
    "volume": options.VolumeFile,
    "raw": options.RawLayoutText,
    "component": options.ComponentName,
    "series": options.SeriesName,
    "array": options.ArrayName,
    "time": options.TimeName,
    "channel": options.ChannelName,
}
"""What to read of which file."""

PLACING: dict[str, Any] = {"scalar_range": options.ScalarRange, "scale": options.ScaleName}
"""Over which values TFs lie."""


def takes_volume(
    placed: bool = True, argument: Any = None
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of a volume in place of its parameter `source`, a `VolumeSource`.

    Parameters
    ----------
    placed : bool
        Whether range and scale can be chosen, too.
    argument : Any
        Annotation of a required argument that stands for ``--volume``.
    """
    offered = {**READING, **(PLACING if placed else {})}
    if argument is not None:
        offered["volume"] = argument

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        own = inspect.signature(command, eval_str=True)
        parameters: list[inspect.Parameter] = []
        for parameter in own.parameters.values():
            if parameter.name != "source":
                parameters.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY))
                continue
            for name, annotation in offered.items():
                required = name == "volume" and argument is not None
                default = inspect.Parameter.empty if required else None
                parameters.append(
                    inspect.Parameter(
                        name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
                    )
                )

        @functools.wraps(command)
        def run(**given: Any) -> None:
            chosen = {name: given.pop(name) for name in offered}
            command(**given, source=values.source(chosen.pop("volume"), **chosen))

        # Typer reads options from both.
        run.__signature__ = own.replace(parameters=parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {each.name: each.annotation for each in parameters}
        return run

    return decorate
