"""How far a training is, and how long it still takes."""

from __future__ import annotations

import time
from typing import Literal

MINUTES = 30.0
"""Budget of a training that the window offers; docs/training.md has the error over the time."""

PREPARING_S, MEASURING_S = 12.0, 20.0
"""Usual times before and after the budget, on 2 cores; they only serve to say what is left."""

Phase = Literal["preparing", "training", "measuring"]

PHASES: tuple[Phase, ...] = ("preparing", "training", "measuring")


def usual_minutes(minutes: float = MINUTES) -> int:
    """Return how long a training of some budget takes in all, in whole minutes."""
    return max(1, round(minutes + (PREPARING_S + MEASURING_S) / 60))


class TrainingClock:
    """Fraction and remaining time of a run: by its word while it trains, else by the clock.

    Parameters
    ----------
    minutes : float
        Budget of the run.
    """

    def __init__(self, minutes: float) -> None:
        self._lengths = dict(zip(PHASES, (PREPARING_S, 60 * minutes, MEASURING_S), strict=True))
        self._phase: Phase = "preparing"
        self._start = time.monotonic()
        self._spent = 0.0

    @property
    def phase(self) -> Phase:
        """What the run is doing."""
        return self._phase

    @property
    def fraction(self) -> float:
        """Fraction of the whole time, 0..1."""
        return self._done / sum(self._lengths.values())

    @property
    def words(self) -> str:
        """What the run is doing, and how long it still takes."""
        passed = time.monotonic() - self._start
        if self._phase != "training" and passed > self._lengths[self._phase]:
            # Nothing is known of what is left then; a time that stood still would be no better.
            return f"{self._phase} for {round(passed)} s, longer than usual"
        left = sum(self._lengths.values()) - self._done
        if left < 55:
            return f"{self._phase}, about {10 * max(1, round(left / 10))} s left"
        return f"{self._phase}, about {round(left / 60)} min left"

    def enter(self, phase: Phase) -> None:
        """Begin the next phase."""
        self._phase, self._start = phase, time.monotonic()

    def note_spent(self, spent: float) -> None:
        """Take what a run says of itself: the fraction of its budget that is spent."""
        self._spent = min(max(spent, 0.0), 1.0)
        if self._phase == "preparing":
            self.enter("training")

    @property
    def _done(self) -> float:
        """Seconds that count as passed."""
        length = self._lengths[self._phase]
        passed = min((time.monotonic() - self._start) / length, 1.0)
        part = self._spent if self._phase == "training" else passed
        earlier = PHASES[: PHASES.index(self._phase)]
        return sum(self._lengths[phase] for phase in earlier) + part * length
