"""The folder of the kernels' machine code, found without importing Numba, which is slow."""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Literal

from model.files import cache_folder

Purpose = Literal["images", "questions"]

SOURCES = (
    "compilation.py",
    "latent/tiny_pictures.py",
    "rendering/brightness.py",
    "rendering/raycast",
    "rendering/path_tracing",
    "rendering/opacity_correction.py",
    "rendering/scalars.py",
    "scene/clip_plane.py",
    "scene/transfer_function.py",
)
"""Folders and modules with compiled functions, the functions they call, and constants of both."""

RUN_FOLDER = "TFSCOPE_KERNELS"
"""Environment variable: a program's temporary folder for itself and its processes if the user's is
not writable."""


def kernel_folder() -> Path:
    """Return the folder of this state of the sources; it need not exist.

    Numba itself detects changes only in a function's own file, not in the functions that it calls.
    """
    digest = hashlib.sha256(version("numba").encode())
    for file in _sources():
        digest.update(file.read_bytes())
    base = os.environ.get(RUN_FOLDER)
    return (Path(base) if base else cache_folder() / "kernels") / digest.hexdigest()[:16]


def _sources() -> Iterator[Path]:
    for place in SOURCES:
        source = Path(__file__).parent / place
        yield from [source] if source.is_file() else sorted(source.rglob("*.py"))


def keeps_kernels() -> bool:
    """Return whether compiled kernels can be stored, and so be compiled by another process."""
    if _is_writable(kernel_folder()):
        return True
    try:
        folder = tempfile.mkdtemp(prefix="tfscope-kernels-")
    except OSError:
        return False
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    os.environ[RUN_FOLDER] = folder
    return _is_writable(kernel_folder())


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


@dataclass(frozen=True)
class KernelGroup:
    """The kernels that the ray caster or path tracer of one light needs for one purpose.

    Voxels are of the type that the kernels take. The purpose is "images", or "questions" about
    sensitivities and what is visible, of which the path tracer answers none.
    """

    voxels: str
    lighting: str
    purpose: Purpose

    @classmethod
    def named(cls, name: str) -> KernelGroup:
        """Return the group of a :attr:`name`."""
        voxels, lighting, purpose = name.split("-")
        return cls(voxels, lighting, "images" if purpose == "images" else "questions")

    @property
    def name(self) -> str:
        """The group as one word."""
        return f"{self.voxels}-{self.lighting}-{self.purpose}"

    @property
    def is_prepared(self) -> bool:
        """Whether they were compiled on this machine, so that they load at once."""
        return self._stamp.exists()

    def note_prepared(self) -> None:
        """Note that they are compiled."""
        self._stamp.touch()

    @property
    def _stamp(self) -> Path:
        """An empty file for these sources, as Numba loads no other sources' code."""
        times = [(str(file), file.stat().st_mtime_ns) for file in _sources()]
        digest = hashlib.sha256(repr(times).encode()).hexdigest()[:8]
        return kernel_folder() / f"{self.name}-{digest}"
