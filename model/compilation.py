"""Compilation of numeric kernels by Numba, and the cache of their machine code."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, TypeVar

import llvmlite.binding
import numba
from numba.core import config

from model.kernel_cache import kernel_folder

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    # All fast-math flags except those that assume no NaN and no infinity.
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}


def _use_cache() -> bool:
    """Set Numba's cache folder; return False if it is not writable."""
    folder = kernel_folder()
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
