"""Compilation of numeric kernels by Numba, and the cache of their machine code."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import llvmlite.binding
import numba
from numba.core import config

from model.files import cache_folder

KERNELS = ("rendering/raycast", "networks/refined")
"""Packages that hold compiled functions and the functions they call."""

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    # All fast-math flags except those that assume no NaN and no infinity.
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}


def _use_cache() -> bool:
    """Set Numba's cache folder, one per state of the sources; return False if not writable.

    Numba itself detects changes only in a function's own file, not in the
    functions that it calls.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for package in KERNELS:
        for source in sorted((Path(__file__).parent / package).rglob("*.py")):
            digest.update(source.read_bytes())
    folder = cache_folder() / "kernels" / digest.hexdigest()[:16]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    config.CACHE_DIR = str(folder)
    return os.access(folder, os.W_OK)


def _avoid_gathers() -> None:
    """Disable gather instructions, which slow down trilinear interpolation."""
    features = llvmlite.binding.get_host_cpu_features()
    if features.get("avx2") and config.CPU_FEATURES is None:
        config.CPU_FEATURES = features.flatten() + ",+prefer-no-gather"


_avoid_gathers()
_CACHE = _use_cache()


def compiled(function: F) -> F:
    """Compile a function for the CPU; it releases the interpreter lock while it runs."""
    return numba.njit(function, cache=_CACHE, **OPTIONS)


def inlined(function: F) -> F:
    """Compile a function that is inlined into its callers, on CPU or GPU."""
    return numba.njit(function, forceinline=True, **OPTIONS)
