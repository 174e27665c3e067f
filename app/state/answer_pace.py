"""Times and sizes of answers while something moves.

All answers together take a tenth of the time, at most a fifth; the rest is for pictures. No shown
answer may be more than half a second old, so answers get smaller, not rarer.
"""

import math
from collections.abc import Callable

from app.engines.pace import Pace
from model.rendering.raster import TIME_GROWTH

SHARE = 0.18  # largest share of the time for answers while something moves
AIM = 0.1  # share for which their sizes are chosen
OLDEST_S = 0.48  # longest age of an answer: half a second, less the time to show it
MOST_DEBT_S = 0.5  # time that answers may overdraw
TOO_OLD_S = 1.0  # age from which an answer is due even beyond the share
FADING = 0.9  # decay of the longest wait with each further one
LIVE_SIZES = (256, 192, 128, 96, 64, 48)  # shorter edges while something moves, in pixels


class AnswerPace(Pace):
    """Remembers how long answers took, and decides when the next are due and how large."""

    def __init__(self, clock: Callable[[], float]) -> None:
        super().__init__(TIME_GROWTH)
        self._clock = clock
        self._gap = self._latency = 0.0
        self.begin()

    def begin(self) -> None:
        """Note that a movement begins: all answers are up to date."""
        self._due = self._asked = self._pictured = self._clock()

    def note_picture(self) -> None:
        """Note that a picture is shown while something moves."""
        now = self._clock()
        self._gap = min(max(now - self._pictured, FADING * self._gap), OLDEST_S)
        self._pictured = now

    def note_live(self, seconds: float) -> None:
        """Note the time of an answer while something moves."""
        # The next picture may have waited for it.
        self._pictured = self._clock()
        self._latency = max(self._pictured - self._asked, self._latency)
        self._due = min(self._due + seconds / SHARE, self._pictured + 2 * TOO_OLD_S)

    @property
    def wait(self) -> float:
        """Seconds until answers are due: when there is time, or the next picture is too late."""
        now = self._clock()
        share, age = self._due - now, self._asked + self._longest - now
        last = age + TOO_OLD_S - OLDEST_S
        return max(min(share, max(age, share - MOST_DEBT_S), last), 0.0)

    def start(self) -> float:
        """Note that questions are sent now, and return their time in seconds."""
        now = self._clock()
        debt = max(self._due - now, 0.0)
        self._asked, self._due = now, now + debt
        self._latency *= FADING
        return AIM * (max(self._longest, self._gap) - debt)

    def size(self, kinds: list[object], largest: int, seconds: float) -> int:
        """Return the size at which all answers together take at most some seconds."""
        sizes = [size for size in LIVE_SIZES if size <= largest] or [largest]

        def needed(size: int) -> float:
            each = (self.expected(kind, size) for kind in kinds)
            return sum(math.inf if one is None else one for one in each)

        return next((size for size in sizes if needed(size) <= seconds), sizes[-1])

    @property
    def _longest(self) -> float:
        """Longest expected time between two questions."""
        return max(OLDEST_S - self._latency - self._gap, 0.0)
