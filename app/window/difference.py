"""How far one image is from another, and that in colours over it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.sensitivity.display import LEAST_DIFFERENCE, overlay, scale_of


def difference_of(drawn: NDArray[np.float32], truth: NDArray[np.float32]) -> NDArray[np.float64]:
    """Root mean squared difference of the colours of each pixel: float64 (S, S).

    Parameters
    ----------
    drawn, truth : ndarray of float32, shape (S, S, 3), in [0, 1]
    """
    return np.sqrt(np.mean((drawn.astype(np.float64) - truth) ** 2, axis=-1))


def in_colors(
    drawn: NDArray[np.float32], difference: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Return an image with a difference over it, (S, S, 3), and what the last colour stands for."""
    scale = scale_of(difference, LEAST_DIFFERENCE)
    return overlay(drawn, difference, scale, "change"), scale
