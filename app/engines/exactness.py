"""Stops of the slider from fast to exact: what an image may take in motion, and owe at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from app.engines.quality import GOOD_ENOUGH
from model.scene.scene import Lighting

USUAL_SECONDS = 1 / 12
"""Time that an image may take while something moves, without a choice."""

MOST_PATIENCE = 2.0
"""Longest time of answers other than images, as a multiple of the usual one."""

Stop = Literal["fast", "balanced", "exact"]
"""Name of a stop."""


@dataclass(frozen=True)
class Exactness:
    """One stop of the trade of speed for accuracy.

    Attributes
    ----------
    live_seconds : float
        Time that an image may take while something moves; infinite for all of its pixels.
    error : float
        Estimated error of a path-traced image at rest from which no more samples are drawn.
    samples : int
        Most samples of each of its pixels.
    distance : float or None
        Between samples of the ray caster and of VTK at rest, in voxels; None for the usual one.
    """

    live_seconds: float
    error: float
    samples: int
    distance: float | None = None

    @property
    def patience(self) -> float:
        """Time that live answers other than images may take, as a multiple of the usual one."""
        return min(self.live_seconds / USUAL_SECONDS, MOST_PATIENCE)

    def distance_in(self, lighting: Lighting) -> float | None:
        """Return the distance between samples under a light; None for the usual one.

        Paths have no steps.
        """
        return None if lighting == "path" else self.distance


STOPS: dict[Stop, Exactness] = {
    # From 32 to 64 samples, a denoised image takes twice the time and loses a tenth of its error.
    "fast": Exactness(1 / 30, 0.012, 32),
    "balanced": Exactness(USUAL_SECONDS, GOOD_ENOUGH, 32),
    "exact": Exactness(math.inf, 0.001, 1024, 0.25),
}
"""The fastest first."""

USUAL: Stop = "balanced"
"""The stop that there is without a choice."""
