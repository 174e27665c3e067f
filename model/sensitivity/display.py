"""Colouring of sensitivity fields over the image that they belong to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.scene.region import block_edges
from model.scene.transfer_function import TF_SAMPLES, Range

RISING, FALLING = np.array([1.0, 0.35, 0.1]), np.array([0.2, 0.5, 1.0])
"""Colours of a field: more opacity brightens, more opacity darkens."""

BACKDROP = 0.35
"""Brightness of the image behind a field."""


def field_of_value(
    field: NDArray[np.float32], value: float | None, scalar_range: Range
) -> NDArray[np.float32]:
    """Select the field of one scalar value.

    Parameters
    ----------
    field : ndarray of float32, shape (rows, columns, 256)
        Over scalar values from one end of the range to the other.
    value : float or None
        In the data's units, inside the range; None takes the mean strength over all
        values, each relative to its own maximum.
    scalar_range : tuple of float

    Returns
    -------
    ndarray of float32, shape (rows, columns)
    """
    if value is None:
        strength = np.abs(field)
        return np.asarray((strength / (strength.max(axis=(0, 1)) + 1e-12)).mean(axis=-1))
    lo, hi = scalar_range
    position = (value - lo) / (hi - lo) * (TF_SAMPLES - 1)
    lower = min(int(position), TF_SAMPLES - 2)
    share = position - lower
    return np.asarray((1 - share) * field[..., lower] + share * field[..., lower + 1])


def overlay(
    image: NDArray[np.float32], field: NDArray[np.float32], block: int
) -> NDArray[np.float64]:
    """Colour a field over its dimmed image.

    Parameters
    ----------
    image : ndarray of float32, shape (S, S, 3)
        In [0, 1].
    field : ndarray of float32, shape (rows, columns)
        One number per block; full colour at its largest magnitude.
    block : int
        Width and height of a block in pixels.

    Returns
    -------
    ndarray of float64, shape (S, S, 3), in [0, 1]
    """
    edges = np.diff(block_edges(len(image), block))
    blocks = field.repeat(edges, axis=0).repeat(edges, axis=1)
    strength = np.clip(blocks / (np.abs(field).max() or 1.0), -1, 1)[..., None]
    color = np.where(strength > 0, RISING, FALLING)
    gray = BACKDROP * image.mean(axis=-1, keepdims=True)
    return np.asarray(gray * (1 - np.abs(strength)) + color * np.abs(strength))


def beside_overlay(
    image: NDArray[np.float32], field: NDArray[np.float32], block: int
) -> NDArray[np.float64]:
    """Put an image and its :func:`overlay` side by side, shape (S, 2 S, 3)."""
    return np.concatenate([image, overlay(image, field, block)], axis=1)
