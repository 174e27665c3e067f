"""Steps from fast to exact: what an image may take while something moves, and owe at rest."""

from __future__ import annotations

from dataclasses import dataclass

from app.engines.messages import GOOD_ENOUGH
from model.scene.scene import Lighting


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

    def distance_in(self, lighting: Lighting) -> float | None:
        """Return the distance between samples under a light; None for the usual one.

        In shadows the length of a step is part of the light, and paths have no steps.
        """
        return None if lighting in ("shadows", "path") else self.distance


STEPS = (
    Exactness(0.015, 0.012, 64, None, "Smooth"),
    Exactness(0.04, 0.006, 64),
    Exactness(0.1, GOOD_ENOUGH, 64, None, "Balanced"),
    Exactness(0.15, 0.002, 256),
    Exactness(0.2, 0.001, 1024, 0.25, "Exact"),
)
"""The fastest first."""

USUAL = 2
"""Number of the step that there is without a choice."""
