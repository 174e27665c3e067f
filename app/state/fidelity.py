"""What is said of an image that is not exact: its error, what becomes of it, and why."""

from __future__ import annotations

from dataclasses import dataclass

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


def figures_text(seconds: float, error: float | None) -> str:
    """Write time and error of an image, such as "28 ms, error .004"."""
    time = f"{1e3 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"
    if error is None:
        return time
    return f"{time}, error {error_text(error)}" if error else f"{time}, exact"


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
