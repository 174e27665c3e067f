"""Channels of one asker to several engines."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from functools import partial
from typing import Literal, TypeVar

from PySide6.QtCore import QObject

from app.engines.client import Channel, EngineClient
from app.engines.messages import Result

EngineName = Literal["exact", "learned"]
"""The ray caster, or a generator."""

_K = TypeVar("_K", bound=Hashable)


class Channels(dict[_K, Channel]):
    """A channel to each of some engines, by the same keys as their clients.

    Parameters
    ----------
    name : str
        Of each of the channels.
    take : callable
        Takes the key of an engine and its :class:`Result`.
    """

    def __init__(
        self,
        clients: Mapping[_K, EngineClient],
        name: str,
        take: Callable[[_K, Result], object],
        parent: QObject,
    ) -> None:
        super().__init__({key: Channel(each, name, parent) for key, each in clients.items()})
        for key, channel in self.items():
            channel.answered.connect(partial(take, key))

    @property
    def is_pending(self) -> bool:
        """Whether an answer of any of the engines is awaited."""
        return any(channel.is_pending for channel in self.values())

    def cancel(self) -> None:
        """Call off what was asked of all of them."""
        for channel in self.values():
            channel.cancel()
