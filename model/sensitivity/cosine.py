"""Cosine similarity and agreement of curves, apart from what loads slowly at the window's start."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

NEGLIGIBLE = 1e-10
"""Norm of displayed responses up to which they are rounding."""


@dataclass(frozen=True)
class Agreement:
    """Cosine of two responses, 1 for one shape, and the learned one's norm in units of the exact
    one's.
    """

    cosine: float
    strength: float


def cosine(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """Cosine similarity of two vectors; 0 if either is zero."""
    a, b = one.astype(np.float64), other.astype(np.float64)
    norms = np.linalg.norm(a) * np.linalg.norm(b)
    return float(a @ b / norms) if norms > 0 else 0.0


def agreement(learned: NDArray[np.float64], exact: NDArray[np.float64]) -> Agreement | None:
    """Compare responses in the displayed unit; None where they are but rounding."""
    own, true = float(np.linalg.norm(learned)), float(np.linalg.norm(exact))
    if max(own, true) < NEGLIGIBLE:
        return None
    return Agreement(cosine(learned, exact), own / true if true > 0 else np.inf)
