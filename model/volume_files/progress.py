"""Progress of reading many slices, handed to the reading thread's listener, which may end it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

from model.errors import VolumeError

Listener = Callable[[str, int, int], object]  # gets what, how many are done, and of how many

_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)

T = TypeVar("T")


class ReadingCancelledError(VolumeError):
    """Raised by a listener, within the reader, to end it."""


@contextmanager
def watched(listener: Listener) -> Iterator[None]:
    """Have a listener called for what is read in this thread meanwhile."""
    token = _listener.set(listener)
    try:
        yield
    finally:
        _listener.reset(token)


def counted(what: str, items: Sequence[T]) -> Iterator[T]:
    """Yield items, and tell before each how many are done, as with ``"slices read"``."""
    listener = _listener.get()
    for number, item in enumerate(items):
        if listener is not None:
            listener(what, number, len(items))
        yield item
