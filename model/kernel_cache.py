"""The folder of the kernels' machine code: found without importing Numba, which takes a while."""

from __future__ import annotations

import hashlib
import math
from importlib.metadata import version
from pathlib import Path

from model.files import cache_folder

SOURCES = (
    "compilation.py",
    "rendering/raycast",
    "rendering/path_tracing",
    "rendering/opacity_correction.py",
    "scene/transfer_function.py",
)
"""Folders and modules with compiled functions, the functions they call, and constants of both."""

PREPARED = (
    ("uint8", "path"),
    ("uint8", "soft"),
    ("float32", "soft"),
    ("int16", "soft"),
    ("uint8", "direct"),
    ("float32", "direct"),
    ("uint8", "none"),
    ("float32", "none"),
)
"""Types of voxels and lights of which kernels may be compiled ahead, those that take longest
first."""


def kernel_folder() -> Path:
    """Return the folder of this state of the sources; it need not exist.

    Numba itself detects changes only in a function's own file, not in the functions that it
    calls.
    """
    digest = hashlib.sha256(version("numba").encode())
    for place in SOURCES:
        source = Path(__file__).parent / place
        for file in [source] if source.is_file() else sorted(source.rglob("*.py")):
            digest.update(file.read_bytes())
    return cache_folder() / "kernels" / digest.hexdigest()[:16]


def has_kernels() -> bool:
    """Return whether some kernels were compiled before, so that they are loaded at once."""
    return next(kernel_folder().glob("**/*.nbc"), None) is not None


def stamp() -> Path:
    """Return the file that is there once the kernels of :data:`PREPARED` were compiled.

    It holds the seconds of a path-traced picture on this machine; see
    :func:`path_traced_seconds`.
    """
    return kernel_folder() / "prepared"


def path_traced_seconds() -> float:
    """Return how long a path-traced picture of one sample took when kernels were compiled ahead.

    Of 256 x 256 pixels of the shipped scan, finished; infinite where it was not measured.
    """
    try:
        return float(stamp().read_text())
    except (OSError, ValueError):
        return math.inf
