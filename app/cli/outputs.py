"""Output files and folders of commands, checked before the work and written after it."""

import json
import os
from pathlib import Path
from typing import Any

from model.errors import TfscopeError, os_errors_as
from model.files import write_atomically


def check_output(path: Path) -> None:
    """Check before a long computation that an output file can be written."""
    if path.is_dir():
        raise _refusal(path, "it is a folder; give the name of a file")
    _check_place(path)


def check_output_folder(path: Path) -> None:
    """Check that a folder exists or can be made, and is writable."""
    if path.exists() and not path.is_dir():
        raise _refusal(
            path, "there is a file of this name, so no folder can be made; choose another"
        )
    _check_place(path)


def make_room_for(path: Path) -> None:
    """Make the folder of an output file, and its parents, if they are missing."""
    with os_errors_as(TfscopeError, f"{path}: its folder cannot be made", "choose another place"):
        path.absolute().parent.mkdir(parents=True, exist_ok=True)


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write a result as JSON, in a folder that is made if it is missing."""
    write_text(path, json.dumps(result, indent=2, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file, in a folder that is made if it is missing."""
    make_room_for(path)
    with os_errors_as(TfscopeError, f"{path}: the result cannot be written"):
        write_atomically(path, text.encode())


def _check_place(path: Path) -> None:
    place = path.absolute()
    while not place.exists():
        place = place.parent
    if place != path.absolute() and not place.is_dir():
        raise _refusal(path, f"{place} is a file, not a folder; choose another place")
    if not os.access(place, os.W_OK):
        raise _refusal(path, "writing there is not allowed; choose another place")


def _refusal(path: Path, trouble: str) -> TfscopeError:
    return TfscopeError(f"{path}: the result cannot be written: {trouble}.")
