"""Atomic file writes, and the user's cache folder."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file completely or not at all, even across a power failure."""
    partial = path.with_name(path.name + ".partial")
    with partial.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)


def cache_folder() -> Path:
    """Return the user's folder for compiled kernels and measurements; it may not exist yet.

    ``XDG_CACHE_HOME/tfscope``, or ``~/.cache/tfscope``; ``LOCALAPPDATA/tfscope`` on Windows.
    """
    base = os.environ.get("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "tfscope"
