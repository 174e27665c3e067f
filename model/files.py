"""Atomic file writes, and the user's cache folder."""

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO


@contextmanager
def writing(path: Path) -> Iterator[BinaryIO]:
    """Open a file for writing that replaces a path once it is complete and on the disk.

    After an error the old file stays, and nothing else is left. A link is followed; a device or a
    pipe is written to directly. Raises :class:`OSError` if it cannot be.
    """
    place = Path(os.path.realpath(path))
    if place.exists() and not place.is_file():
        with place.open("wb") as file:
            yield file
        return
    partial = place.with_name(place.name + ".partial")
    try:
        with partial.open("wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(place)
    except BaseException:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        raise
    _sync_folder(place.parent)


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file atomically, even across a power failure; see :func:`writing`."""
    with writing(path) as file:
        file.write(content)


def free_space(path: Path) -> int:
    """Free bytes at the place of a file or folder, which need not exist."""
    place = path.absolute()
    return shutil.disk_usage(next(p for p in (place, *place.parents) if p.exists())).free


def _sync_folder(folder: Path) -> None:
    """Make a new name in a folder survive a power failure, if the system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def cache_folder() -> Path:
    """Return the user's folder for compiled kernels and measurements; it may not exist yet.

    ``XDG_CACHE_HOME/tfscope``, or ``~/.cache/tfscope``; ``LOCALAPPDATA/tfscope`` on Windows.
    """
    base = os.environ.get("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "tfscope"
