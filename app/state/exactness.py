"""Steps from fast to exact: what an image may take while something moves, and owe at rest."""

from __future__ import annotations

from dataclasses import dataclass

from app.engines.quality import GOOD_ENOUGH
from model.errors import TfscopeError
from model.scene.scene import Lighting

USUAL_SECONDS = 0.1
"""Time that an image may take while something moves, without a choice."""


@dataclass(frozen=True)
class Exactness:
    """One step of the trade of speed for accuracy.

    Attributes
    ----------
    live_seconds : float
        Time that an image may take while something moves.
    error : float
        Estimated error of a path-traced image at rest from which no more samples are drawn.
    samples : int
        Most samples of each of its pixels.
    distance : float or None
        Between samples of the ray caster and of VTK at rest, in voxels; None for the usual one.
    name : str
        Empty for the steps between.
    """

    live_seconds: float
    error: float
    samples: int
    distance: float | None = None
    name: str = ""

    @property
    def patience(self) -> float:
        """Time that live answers other than images may take, as a multiple of the usual one."""
        return self.live_seconds / USUAL_SECONDS

    def distance_in(self, lighting: Lighting) -> float | None:
        """Return the distance between samples under a light; None for the usual one.

        In shadows the length of a step is part of the light, and paths have no steps.
        """
        return None if lighting in ("shadows", "path") else self.distance


STEPS = (
    Exactness(0.015, 0.012, 64, None, "Smooth"),
    Exactness(0.04, 0.006, 64),
    Exactness(USUAL_SECONDS, GOOD_ENOUGH, 64, None, "Balanced"),
    Exactness(0.15, 0.002, 256),
    Exactness(0.2, 0.001, 1024, 0.25, "Exact"),
)
"""The fastest first."""

USUAL = 2
"""Number of the step that there is without a choice."""


def step_for(budget_ms: float | None, error: float | None) -> int | None:
    """Return the number of the step that keeps to a time and an error; None if neither is given.

    Parameters
    ----------
    budget_ms : float or None
        Milliseconds that an image may take while something moves: the most exact step is taken
        that allows no more.
    error : float or None
        Estimated error that path-traced images at rest are to come to: the fastest such step.

    Raises
    ------
    TfscopeError
        When no step keeps to it.
    """
    if budget_ms is None and error is None:
        return None
    within = [
        n for n, s in enumerate(STEPS) if budget_ms is None or 1e3 * s.live_seconds <= budget_ms
    ]
    fine = [n for n, s in enumerate(STEPS) if error is None or s.error <= error]
    if not within:
        least = 1e3 * STEPS[0].live_seconds
        raise TfscopeError(
            f"{budget_ms:g} ms for an image is too little; give {least:.0f} or more."
        )
    if not fine:
        raise TfscopeError(
            f"An error of {error:g} takes too long for a window; give {STEPS[-1].error:g} or more."
        )
    if error is None:
        return within[-1]
    if fine[0] > within[-1]:
        needed = 1e3 * STEPS[fine[0]].live_seconds
        raise TfscopeError(
            f"An error of {error:g} goes with {needed:.0f} ms for an image while something moves; "
            f"allow these, or give an error of {STEPS[within[-1]].error:g} or more."
        )
    return fine[0] if budget_ms is None else within[-1]
