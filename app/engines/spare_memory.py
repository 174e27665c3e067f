"""Giving memory that is free inside the process back to the system."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache


def give_back_memory() -> None:
    """Have the C library return the pages that it keeps for later; nothing where it cannot.

    After images of many sizes it keeps some hundred megabytes. Takes up to some ten
    milliseconds, without Python's lock.
    """
    trim = _trimmer()
    if trim is not None:
        trim(0)


@cache
def _trimmer() -> Callable[[int], int] | None:
    """Function of glibc; other C libraries have none."""
    if not sys.platform.startswith("linux"):
        return None
    try:
        return ctypes.CDLL(None).malloc_trim
    except (OSError, AttributeError):
        return None
