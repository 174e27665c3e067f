"""Keeping of what images while something moves cost, for each machine and volume."""

from __future__ import annotations

import os
from dataclasses import dataclass

from app.state.preferences import Preferences
from app.state.remembered import MOST_TRADES, KnownTrade
from model.measurements import processor_name
from model.scene.scene import Lighting, RendererName

LAST = 8
"""Scenes over which times and errors are averaged; with more, those long ago count less."""

SAME_SIZE = 1.5
"""Factor of the width between images that are compared with each other."""

GROWTH = 0.83
"""Power of the number of pixels with which times grow, see :mod:`model.evaluation.prediction`."""


@dataclass(frozen=True)
class Traded:
    """An image of fewer pixels than at rest: its time, and its distance from the one at rest.

    Attributes
    ----------
    scale : float
        Part of the width that is drawn.
    seconds : float
    error : float
        Root mean square of the colours' differences, 0 to 1.
    """

    scale: float
    seconds: float
    error: float

    def mixed(self, other: Traded, part: float) -> Traded:
        """Return the mean with another one, of which this is a part from 0 to 1."""
        seconds = other.seconds + part * (self.seconds - other.seconds)
        return Traded(self.scale, seconds, other.error + part * (self.error - other.error))


class TradeKeeper:
    """Keeps the mean time and error of images over the scenes of one volume on this machine.

    Parameters
    ----------
    preferences : Preferences
        They are kept there.
    """

    def __init__(self, preferences: Preferences) -> None:
        self._preferences = preferences
        self._fingerprint = ""
        self._lighting: Lighting = "none"

    def follow(self, fingerprint: str, lighting: Lighting) -> None:
        """Keep those of a volume under a light from now on."""
        self._fingerprint, self._lighting = fingerprint, lighting

    def scenes(self, renderer: RendererName, size: float) -> int:
        """Return the number of scenes that were measured, 0 if none was."""
        known = self._known(renderer, size)
        return 0 if known is None else known.scenes

    def expected(self, renderer: RendererName, size: float) -> tuple[Traded, ...]:
        """Predict the images of a scene that was not measured: by the mean of those that were.

        Parameters
        ----------
        renderer : {"vtk", "raycast"}
            Who draws while something moves.
        size : float
            Square root of the number of pixels at rest.

        Returns
        -------
        tuple of Traded
            The fewest pixels first; empty if nothing is known.
        """
        known = self._known(renderer, size)
        if known is None:
            return ()
        growth = (size / known.size) ** (2 * GROWTH)
        return tuple(Traded(scale, growth * s, error) for scale, s, error in known.images)

    def note(self, renderer: RendererName, size: float, found: tuple[Traded, ...]) -> None:
        """Keep the images of one more scene."""
        if not self._fingerprint:
            return
        old = self._known(renderer, size)
        images, scenes = [(each.scale, each.seconds, each.error) for each in found], 1
        if old is not None and [each[0] for each in old.images] == [each[0] for each in images]:
            part = 1 / min(old.scenes + 1, LAST)
            scenes = old.scenes + 1
            before = self.expected(renderer, size)
            mixed = [now.mixed(was, part) for now, was in zip(found, before, strict=True)]
            images = [(each.scale, each.seconds, each.error) for each in mixed]
        new = KnownTrade(machine_name(), self._lighting, renderer, size, scenes, tuple(images))
        others = (each for each in self._all() if not self._is_of(each, renderer))
        trades = (*others, new)[-MOST_TRADES:]
        self._preferences.note_volume(self._fingerprint, trades=trades)

    def _all(self) -> tuple[KnownTrade, ...]:
        return self._preferences.volume(self._fingerprint).trades

    def _known(self, renderer: RendererName, size: float) -> KnownTrade | None:
        for each in self._all():
            if self._is_of(each, renderer):
                is_alike = 1 / SAME_SIZE <= size / each.size <= SAME_SIZE
                return each if is_alike else None
        return None

    def _is_of(self, trade: KnownTrade, renderer: RendererName) -> bool:
        of = trade.machine, trade.lighting, trade.renderer
        return of == (machine_name(), self._lighting, renderer)


def machine_name() -> str:
    """Return the processor and its threads, by which times differ."""
    return f"{processor_name()}, {os.cpu_count() or 1} threads"
