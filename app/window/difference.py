"""How far a generator's image is from the ground truth, on the screen and in figures alike."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.rendering.resizing import at_size_of
from model.sensitivity.display import LEAST_DIFFERENCE, overlay, scale_of

Image = NDArray[np.float32]


def difference_of(drawn: Image, truth: Image) -> NDArray[np.float64]:
    """Root mean squared difference of the colours of each of the generator's pixels: (S, S).

    Parameters
    ----------
    drawn : ndarray of float32, shape (S, S, 3)
        The generator's image; values outside [0, 1] are clipped.
    truth : ndarray of float32, shape (H, W, 3)
        The ground truth as it is shown, mostly finer: what it shows in the middle of a pixel of
        the generator's is compared. Means would count what any image of so few pixels lacks.
    """
    # Not by model.metrics: it imports torch and more, without which the window starts.
    one, other = (np.clip(np.nan_to_num(image), 0, 1) for image in (drawn, truth))
    sampled = np.clip(at_size_of(one, other, sampled=True), 0, 1)
    return np.sqrt(np.mean((one.astype(np.float64) - sampled) ** 2, axis=-1))


def in_colors(drawn: Image, difference: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return an image with a difference over it, (S, S, 3), and what the last colour stands for."""
    scale = scale_of(difference, LEAST_DIFFERENCE)
    return overlay(drawn, difference, scale, "change"), scale


def meaning(pixels: int) -> str:
    """What the colours of a difference are, of a generator's image with so many pixels a side."""
    return f"difference from the ground truth at {pixels} × {pixels} pixels"
