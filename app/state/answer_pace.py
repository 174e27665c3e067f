"""Rhythm and sizes of answers while something moves.

The pictures have the time: all answers together take a seventh of it. Yet none that is
shown is of what was there more than half a second ago. So answers become smaller, not rarer.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from app.engines.pace import Pace
from model.rendering.raster import TIME_GROWTH

SHARE = 0.13  # part of the time that answers may take while something moves
OLDEST_S = 0.48  # age of an answer when the next is there: half a second, less the showing
MOST_DEBT_S = 0.5  # time that answers may take beyond their share, to give it back later
TOO_OLD_S = 1.0  # age from which an answer comes before the share, on a slow machine
FADING = 0.9  # factor by which the longest wait so far counts less with each that follows
LIVE_SIZES = (256, 192, 128, 96, 64, 48)  # shorter edges while something moves, in pixels


class AnswerPace(Pace):
    """Remembers how long answers took, and says when the next are due, and how large."""

    def __init__(self, clock: Callable[[], float]) -> None:
        super().__init__(TIME_GROWTH)
        self._clock = clock
        self._gap = self._latency = 0.0
        self.begin()

    def begin(self) -> None:
        """Note that something begins to move: what is shown is of now."""
        self._due = self._asked = self._pictured = self._clock()

    def note_picture(self) -> None:
        """Note that a picture is shown while something moves."""
        now = self._clock()
        self._gap = min(max(now - self._pictured, FADING * self._gap), OLDEST_S)
        self._pictured = now

    def note_live(self, seconds: float) -> None:
        """Note what an answer took while something moves, and when it came."""
        # The next picture may have waited for it.
        self._pictured = self._clock()
        self._latency = max(self._pictured - self._asked, self._latency)
        self._due = min(self._due + seconds / SHARE, self._pictured + 2 * TOO_OLD_S)

    @property
    def wait(self) -> float:
        """Seconds until something is due: until there is time, or at the next picture too late."""
        now = self._clock()
        share, age = self._due - now, self._asked + self._longest - now
        last = age + TOO_OLD_S - OLDEST_S
        return max(min(share, max(age, share - MOST_DEBT_S), last), 0.0)

    def start(self) -> float:
        """Note that all is asked now, and return the seconds that it may take together."""
        now = self._clock()
        debt = max(self._due - now, 0.0)
        self._asked, self._due = now, now + debt
        self._latency *= FADING
        return SHARE * (max(self._longest, self._gap) - debt)

    def size(self, kinds: list[object], largest: int, seconds: float) -> int:
        """Return the size at which answers of all kinds together take at most some seconds."""
        sizes = [size for size in LIVE_SIZES if size <= largest] or [largest]

        def needed(size: int) -> float:
            each = (self.expected(kind, size) for kind in kinds)
            return sum(math.inf if one is None else one for one in each)

        return next((size for size in sizes if needed(size) <= seconds), sizes[-1])

    @property
    def _longest(self) -> float:
        """Longest time between two questions, if pictures and answers come as they did."""
        return max(OLDEST_S - self._latency - self._gap, 0.0)
