"""Opacity correction for the sample distance, and its derivative."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NEARLY_OPAQUE = 1 - 1 / 510
"""Opacity above which the derivative is clamped: half an 8-bit step below 1."""


def per_sample(opacity: NDArray[np.floating], sample_distance: float) -> NDArray[np.float64]:
    """Opacity of one sample: 1 - (1 - a)^s."""
    # Logarithms keep full precision for small opacities, and are exact at 0 and at 1.
    with np.errstate(divide="ignore"):
        return -np.expm1(sample_distance * np.log1p(-opacity.astype(np.float64)))


def least_transparency(sample_distance: float) -> float:
    """Transparency of a sample at :data:`NEARLY_OPAQUE`, below which derivatives are clamped."""
    return float((1 - NEARLY_OPAQUE) ** sample_distance)


def per_sample_derivative(
    opacity: NDArray[np.floating], sample_distance: float
) -> NDArray[np.float64]:
    """Derivative s (1 - a)^(s - 1) of :func:`per_sample` by the opacity.

    For s < 1 it diverges at a = 1; above :data:`NEARLY_OPAQUE` it is clamped to
    the value there, so that it is finite and edits of an opaque TF have an effect.
    """
    transparency = 1 - opacity.astype(np.float64)
    if sample_distance < 1:
        transparency = np.maximum(transparency, 1 - NEARLY_OPAQUE)
    return sample_distance * transparency ** (sample_distance - 1)
