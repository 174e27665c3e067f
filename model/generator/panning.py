"""Panned pictures of generators, whose view parameters (paper, section 4) know no panning."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import shift

from model.scene.region import Mask
from model.scene.view import View


def panned(pictures: NDArray[np.float32], view: View) -> NDArray[np.float32]:
    """Move pictures as a view is panned; what comes in from outside is black and transparent.

    Parameters
    ----------
    pictures : ndarray of float32, shape (..., S, S, C)
    """
    if view.pan_x == view.pan_y == 0.0:
        return pictures
    size = pictures.shape[-2]
    down, right = -view.pan_y * size / 2, view.pan_x * size / 2
    still = (0.0,) * (pictures.ndim - 3)
    return shift(pictures, (*still, down, right, 0.0), order=1, mode="constant")


def unpanned(mask: Mask, view: View) -> Mask:
    """Return the pixels of a picture before panning that a mask (S, S) of the panned one shows."""
    back = replace(view, pan_x=-view.pan_x, pan_y=-view.pan_y)
    return panned(mask[..., None].astype(np.float32), back)[..., 0] > 0.5
