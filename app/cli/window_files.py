"""Files among the window's arguments: ``main.py FILE`` for ``main.py --volume FILE``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from model.errors import TfscopeError
from model.networks.card import MODEL_FILE

if TYPE_CHECKING:
    from typer.core import TyperGroup

OPTIONS = {".json": "--tf", ".tfscope": "--session"}
"""By the suffix of a file."""


def with_options_for_files(arguments: Sequence[str], application: TyperGroup) -> list[str]:
    """Put the window's options before files that are given without one.

    A model's folder gets ``--model``, a JSON file ``--tf``, a session ``--session``, any other
    file or folder ``--volume``. A command's name is a command, whatever files there are, and
    from there on nothing is changed.
    """
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
            # The value of an option is no file of its own, even where it begins with "-".
            if option is not None and not getattr(option, "is_flag", False):
                found += [value for value in (next(words, None),) if value is not None]
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
            f"'{word}' is neither a command ({commands}) nor a file or folder that is there. "
            "See --help."
        )
    if path.is_dir():
        return "--model" if (path / MODEL_FILE).exists() else "--volume"
    return OPTIONS.get(path.suffix.lower(), "--volume")
