"""Panned pictures of generators, which are trained on pictures that are not panned."""

from __future__ import annotations

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
    view : View
    """
    if not _is_panned(view):
        return pictures
    size = pictures.shape[-2]
    down, right = -view.pan_y * size / 2, view.pan_x * size / 2
    still = (0.0,) * (pictures.ndim - 3)
    moved = shift(pictures, (*still, down, right, 0.0), order=1, mode="constant")
    return np.asarray(moved, dtype=np.float32)


def unpanned(mask: Mask, view: View) -> Mask:
    """Return the pixels of a picture before panning that a mask (S, S) of the panned one shows."""
    if not _is_panned(view):
        return mask
    size = len(mask)
    rows, columns = np.nonzero(mask)
    rows = rows + round(view.pan_y * size / 2)
    columns = columns - round(view.pan_x * size / 2)
    inside = (rows >= 0) & (rows < size) & (columns >= 0) & (columns < size)
    before = np.zeros_like(mask)
    before[rows[inside], columns[inside]] = True
    return before


def _is_panned(view: View) -> bool:
    return view.pan_x != 0.0 or view.pan_y != 0.0
