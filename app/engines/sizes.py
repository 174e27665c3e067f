"""Numbers of pixels of an engine's images, chosen by the time that those before took."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from app.engines.pace import Pace
from model.rendering.raster import TIME_GROWTH, Raster

SOON_SECONDS = 0.2
"""Time that the first image at rest may take; where all pixels take longer, they follow it."""

REST_SECONDS = 3.0
"""Time that the next one may take."""

LONGEST_SECONDS = 120.0
"""Time that an image of all pixels may take, unless their number is the user's choice; otherwise
there are as many as that allows."""

FINER = 1.2
"""Smallest factor by which the next image is wider."""

FIRST_SIZE = 384
"""Largest side of the first image, before it is known how long its pixels take."""

FIRST_SCALE, FIRST_SLOW_SCALE = 0.35, 0.25
"""Parts of the width that it has, without and with light that takes long."""


class Sizes(Pace):
    """Knows how long pixels take, by the kind of image, and so how many there is time for.

    Parameters
    ----------
    first : float
        Part of the width of the first image, before anything is known.
    """

    def __init__(self, first: float = FIRST_SCALE) -> None:
        # Of small images a good part of the time has nothing to do with their pixels.
        super().__init__(TIME_GROWTH)
        self._first_part = first

    def is_slow(self, kind: object, raster: Raster) -> bool:
        """Return whether something is to be seen before an image, as that may take long."""
        return (self.expected(kind, raster.side) or math.inf) > SOON_SECONDS

    def within(self, kind: object, whole: Raster, seconds: float) -> Raster:
        """Return the most pixels, at most the whole image's, that there is time for."""
        first = min(self._first_part, FIRST_SIZE / whole.side)
        return whole.scaled(self.scale(kind, whole.side, seconds, first))

    def at_rest(
        self,
        kind: object,
        whole: Raster,
        width: int,
        limits: Sequence[float],
        must_end: bool = True,
    ) -> Iterator[tuple[Raster, bool]]:
        """Yield the pixels of ever finer images, and whether it is the last.

        How long one of them took, which is noted meanwhile, tells the size of the next.

        Parameters
        ----------
        width : int
            That of the image which is shown; 0 if there is none. None but the last is coarser,
            which is as fine as those before at least.
        limits : sequence of float
            Seconds that each may take.
        must_end : bool
            Whether the last is wanted even if it is coarser.
        """
        finest = None
        for number, seconds in enumerate(limits, 1):
            is_last = number == len(limits)
            is_known = self.expected(kind, whole.side) is not None
            raster = whole if is_last and not is_known else self.within(kind, whole, seconds)
            is_last = is_last or raster.width >= whole.width
            if finest is not None and raster.width <= FINER * finest.width:
                raster = finest
            if raster.width > FINER * width or (is_last and must_end):
                finest, width = raster, raster.width
                yield raster, is_last
            if is_last:
                return
