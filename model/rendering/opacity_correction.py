"""Opacity of a sample from the opacity of a voxel's length, and its derivative."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NEARLY_OPAQUE = 1 - 1 / 510
"""Where the derivative is cut off: the last opacity that 8 bits tell from 1."""


def per_sample(opacity: NDArray[np.floating], sample_distance: float) -> NDArray[np.float64]:
    """Opacity of one sample: 1 - (1 - a)^s.

    Parameters
    ----------
    opacity : ndarray, any shape
        Opacity a of a voxel's length, in [0, 1].
    sample_distance : float
        Length s of the sample, in voxels.
    """
    # By logarithms, which keep all digits of small opacities; exact at 0 and at 1.
    with np.errstate(divide="ignore"):
        return -np.expm1(sample_distance * np.log1p(-opacity.astype(np.float64)))


def per_sample_derivative(
    opacity: NDArray[np.floating], sample_distance: float
) -> NDArray[np.float64]:
    """Derivative s (1 - a)^(s - 1) of :func:`per_sample` by the opacity.

    For s < 1 it grows beyond all bounds towards a = 1; above
    :data:`NEARLY_OPAQUE` it keeps the value there, so that it is finite and
    an edit of an opaque TF still has an effect.
    """
    transparency = 1 - opacity.astype(np.float64)
    if sample_distance < 1:
        transparency = np.maximum(transparency, 1 - NEARLY_OPAQUE)
    return sample_distance * transparency ** (sample_distance - 1)
