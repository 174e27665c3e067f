"""Work on arrays, divided among threads: NumPy releases the interpreter's lock."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from model.measurements import processors

_Item = TypeVar("_Item")
_Found = TypeVar("_Found")


def in_threads(call: Callable[[_Item], _Found], items: Iterable[_Item]) -> list[_Found]:
    """Return what a function finds for each item, in a thread per processor."""
    with ThreadPoolExecutor(processors()) as threads:
        return list(threads.map(call, items))
