"""CIELAB colours, scaled for the networks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LAB_LOW = np.array([0.0, -86.185, -107.863])
LAB_HIGH = np.array([100.0, 98.254, 94.482])
"""Extent of the RGB cube in CIELAB (L, a, b)."""


def rgb_to_lab(rgb: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert sRGB (..., 3) to CIELAB, each channel scaled so that the RGB cube fills [-1, 1].

    Values outside [0, 1] are clipped first: CIELAB is undefined there.
    """
    # Imported here: it takes most of a second, and few commands need it.
    from skimage.color import rgb2lab

    lab = rgb2lab(np.clip(rgb, 0.0, 1.0))
    return (2 * (lab - LAB_LOW) / (LAB_HIGH - LAB_LOW) - 1).astype(np.float32)
