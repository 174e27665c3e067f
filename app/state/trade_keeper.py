"""Keeping of what images while something moves cost, for each machine and volume.

What is kept are factors: of the time of the image at rest, and of the error that it has with a
quarter of its pixels. These are known of a scene before any of its coarser images is drawn, and
vary more from scene to scene than the factors do.
"""

from __future__ import annotations

import os
from dataclasses import dataclass

from app.state.fidelity import LEAST_SAID
from app.state.known_volume import MOST_TRADES, KnownTrade
from app.state.preferences import Preferences
from model.measurements import processor_name
from model.rendering.raster import TIME_GROWTH
from model.scene.scene import Lighting, RendererName

LAST = 8
"""Scenes over which times and errors are averaged; with more, those long ago count less."""

SAME_SIZE = 1.5
"""Factor of the width between images that are compared with each other."""


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


@dataclass(frozen=True)
class AtRest:
    """An image at rest: its time, and its distance from itself with a quarter of its pixels.

    Attributes
    ----------
    seconds : float
        In path-traced light of one sample of each pixel.
    error : float
        See :class:`Traded`.
    """

    seconds: float
    error: float

    @property
    def is_telling(self) -> bool:
        """Whether there is enough in the image to divide by."""
        return self.seconds > 0 and self.error > LEAST_SAID


class TradeKeeper:
    """Keeps the mean factors over the scenes of one volume on this machine.

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

    def expected(
        self, renderer: RendererName, size: float, rest: AtRest | None = None
    ) -> tuple[Traded, ...]:
        """Predict the images of a scene that was not measured.

        Parameters
        ----------
        renderer : {"vtk", "raycast"}
            Who draws while something moves.
        size : float
            Square root of the number of pixels at rest.
        rest : AtRest or None
            Of this scene; None for the mean of those that were measured.

        Returns
        -------
        tuple of Traded
            The fewest pixels first; empty if nothing is known.
        """
        known = self._known(renderer, size)
        if known is None:
            return ()
        if rest is None:
            growth = (size / known.size) ** (2 * TIME_GROWTH)
            rest = AtRest(growth * known.seconds, known.error)
        return tuple(
            Traded(scale, seconds * rest.seconds, error * rest.error)
            for scale, seconds, error in known.images
        )

    def note(
        self, renderer: RendererName, size: float, rest: AtRest, found: tuple[Traded, ...]
    ) -> None:
        """Keep the images of one more scene."""
        if not self._fingerprint or not rest.is_telling:
            return
        factors = [(t.scale, t.seconds / rest.seconds, t.error / rest.error) for t in found]
        old, scenes = self._known(renderer, size), 1
        if old is not None and [each[0] for each in old.images] == [each[0] for each in factors]:
            scenes = old.scenes + 1
            part = 1 / min(scenes, LAST)
            factors = [
                (scale, _mixed(was[1], seconds, part), _mixed(was[2], error, part))
                for was, (scale, seconds, error) in zip(old.images, factors, strict=True)
            ]
            rest = AtRest(
                _mixed(old.seconds, rest.seconds, part), _mixed(old.error, rest.error, part)
            )
        new = KnownTrade(
            machine_name(),
            self._lighting,
            renderer,
            size,
            scenes,
            rest.seconds,
            rest.error,
            tuple(factors),
        )
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


def _mixed(before: float, now: float, part: float) -> float:
    return before + part * (now - before)
