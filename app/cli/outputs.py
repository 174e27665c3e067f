"""Output files of commands, checked before the work and written after it."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from model.errors import TfscopeError


def check_outputs(*paths: Path | None) -> None:
    """Check that output files can be written, before a long computation.

    Raises
    ------
    TfscopeError
        When one of the files could not be written.
    """
    for path in filter(None, paths):
        folder = path.absolute().parent
        trouble = None
        if path.is_dir():
            trouble = "it is a folder; give the name of a file"
        elif not folder.is_dir():
            trouble = f"there is no folder {folder}; make it, or choose another place"
        elif not os.access(path if path.exists() else folder, os.W_OK):
            trouble = "writing there is not allowed; choose another place"
        if trouble is not None:
            raise TfscopeError(f"{path}: the result cannot be written: {trouble}.")


def write_json(path: Path, result: dict[str, Any]) -> None:
    """Write a result as JSON; see :func:`write_text`."""
    write_text(path, json.dumps(result, indent=2, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file.

    Raises
    ------
    TfscopeError
        When the file cannot be written.
    """
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise TfscopeError(f"{path}: the result cannot be written ({error.strerror}).") from error
