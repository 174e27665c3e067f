"""Giving memory that is free inside the process back to the system, at once or when asked."""

from __future__ import annotations

import ctypes
import sys
from functools import cache

LARGE_BLOCK = 1 << 20
"""Size in bytes from which blocks go back to the system as soon as they are freed."""

_MMAP_THRESHOLD = -3
"""Name of that size for glibc's ``mallopt``."""


@cache
def return_large_blocks() -> None:
    """Have the C library return large blocks when they are freed; nothing where it cannot.

    By itself it soon keeps blocks of up to 32 MB for later. The window's start takes 15 MB less,
    and images take as long.
    """
    library = _glibc()
    if library is not None:
        library.mallopt(_MMAP_THRESHOLD, LARGE_BLOCK)


def give_back_memory() -> None:
    """Have the C library return the pages that it keeps for later; nothing where it cannot.

    After images of many sizes it keeps some hundred megabytes. Takes up to some ten
    milliseconds, without Python's lock.
    """
    library = _glibc()
    if library is not None:
        library.malloc_trim(0)


@cache
def _glibc() -> ctypes.CDLL | None:
    """The C library where it is glibc; others have no such functions."""
    if not sys.platform.startswith("linux"):
        return None
    library = ctypes.CDLL(None)
    return library if hasattr(library, "malloc_trim") and hasattr(library, "mallopt") else None
