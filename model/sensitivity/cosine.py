"""Cosine similarity, apart from what loads slowly: the window needs it at its start."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def cosine(one: NDArray[np.floating], other: NDArray[np.floating]) -> float:
    """Cosine similarity of two vectors; 0 if either is zero."""
    a, b = one.astype(np.float64), other.astype(np.float64)
    norms = np.linalg.norm(a) * np.linalg.norm(b)
    return float(a @ b / norms) if norms > 0 else 0.0
