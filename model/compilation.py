"""Compilation of numeric kernels by Numba, and the cache of their machine code."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from filelock import FileLock, Timeout
from numba.core import config
from numba.core.compiler_lock import global_compiler_lock

from model.kernel_cache import keeps_kernels, kernel_folder

OPTIONS: dict[str, Any] = {
    "nogil": True,
    "error_model": "numpy",
    # All fast-math flags except those that assume no NaN and no infinity.
    "fastmath": {"contract", "reassoc", "nsz", "arcp"},
}

LONGEST_S = 120.0
"""Time that another process is given to compile a kernel; then it is compiled here, too."""


def _use_cache() -> bool:
    """Set Numba's cache folder; return False if it is not writable."""
    is_kept = keeps_kernels()
    if is_kept:
        config.CACHE_DIR = str(kernel_folder())
    return is_kept


def _avoid_gathers() -> None:
    """Disable gather instructions, which slow down trilinear interpolation."""
    features = llvmlite.binding.get_host_cpu_features()
    if features.get("avx2") and config.CPU_FEATURES is None:
        config.CPU_FEATURES = features.flatten() + ",+prefer-no-gather"


_avoid_gathers()
_CACHE = _use_cache()


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a function for the CPU; it releases the interpreter lock while it runs.

    What one process compiles, others that need it meanwhile wait for, and load.
    """
    kernel = numba.njit(function, cache=_CACHE, **OPTIONS)
    if _CACHE:
        kernel.compile = _by_one_process(kernel.compile, function.__qualname__)
    return kernel


def _by_one_process(compile_: Callable[[Any], Any], name: str) -> Callable[[Any], Any]:
    """Return a kernel's function that compiles a signature, or loads it, one process at a time."""

    def compile_alone(signature: Any) -> Any:
        # Another copy of the sources has machine code of its own.
        digest = hashlib.sha256(f"{__file__} {signature!r}".encode()).hexdigest()[:16]
        lock = FileLock(Path(config.CACHE_DIR) / f"{name}-{digest}.lock", timeout=LONGEST_S)
        # The order in which Numba locks: it compiles what a kernel calls while it holds its own.
        with global_compiler_lock:
            try:
                with lock:
                    return compile_(signature)
            except (Timeout, OSError):
                return compile_(signature)

    return compile_alone


def inlined(function: Callable[..., Any]) -> Any:
    """Compile a function that is inlined into its callers."""
    return numba.njit(function, forceinline=True, **OPTIONS)


def called(function: Callable[..., Any]) -> Any:
    """Compile a function that stays one in its callers: rarely used, and long where inlined."""
    return numba.njit(function, inline="never", **OPTIONS)
