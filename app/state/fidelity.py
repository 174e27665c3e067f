"""What is said of an image that is not exact: its error, what becomes of it, and why."""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.engines.exactness import Exactness

REFINING = "refining"
MOVING = "coarser while moving"
COARSE = "{} of {} pixels across"

LET_GO = "The image is coarser while something moves."
WAIT = "The image becomes finer from here on."
ESTIMATED = "The error is estimated from the differences between samples."
ENDS = (
    "Refining ends at {} samples per pixel. Choose Exact in the bar above for more, or use the "
    "command render with --samples or --error."
)
MORE = "Choose Exact in the bar above for a smaller error."
TOO_LONG = "All pixels take too long here. Make the window smaller, or choose a faster light."
LEAST_SAID = 1e-4
"""Error below which no figure is more than noise."""


def error_text(error: float) -> str:
    """Write an error in two digits, such as ".0042"."""
    return f"{max(error, LEAST_SAID):.2g}".replace("0.", ".", 1)


def rate_text(seconds: float) -> str:
    """Write how many images of some time there are in a second, such as "12 / s"."""
    rate = min(1 / max(seconds, 1e-9), 999.0)
    return f"{rate:.0f} / s" if rate >= 9.5 else f"{rate:.1f} / s".replace("0.", ".", 1)


def pace_text(stop: Exactness) -> str:
    """Write what a stop holds images to while something moves, such as "12 / s"."""
    return "all pixels" if math.isinf(stop.live_seconds) else rate_text(stop.live_seconds)


def figures_text(seconds: float, error: float | None) -> str:
    """Write rate and error of images, such as "12 / s, error .004"."""
    rate = rate_text(seconds)
    if error is None:
        return rate
    return f"{rate}, error {error_text(error)}" if error else f"{rate}, exact"


@dataclass(frozen=True)
class Fidelity:
    """What is said of an image that is not exact; nothing of one that is.

    Attributes
    ----------
    error : float or None
        Root mean square of the colours' errors; None if it is not known.
    state : str
        What becomes of it, in words; may be empty.
    reasons : tuple of str
        Sentences on where the error comes from, and how to get better.
    """

    error: float | None = None
    state: str = ""
    reasons: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """One short line, such as "error .004, refining"; empty of an exact image."""
        if self.error is None:
            return self.state
        error = f"error {error_text(self.error)}"
        return f"{error}, {self.state}" if self.state else error
