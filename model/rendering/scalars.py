"""The volume's scalars in a type that a renderer takes, without loss."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import Range
from model.scene.volume import Volume

WELL_CONDITIONED = 256.0
"""Largest ratio of the values' size to their range that float32 holds as it is.

At this ratio rounding is 1/256 of a TF bin.
"""

NARROWEST, WIDEST = 1e-30, 1e30
"""Ranges between which float32 has room for differences and reciprocals of the values."""


def renderable_scalars(
    volume: Volume, native: tuple[type[np.generic], ...]
) -> tuple[NDArray[Any], Range]:
    """Scalars for a renderer, and the range that they span there.

    Parameters
    ----------
    volume : Volume
    native : tuple of scalar types
        Those that the renderer takes as they are.

    Returns
    -------
    scalars : ndarray, shape (nz, ny, nx)
        The volume's own array where its type is native; otherwise a float32
        copy mapped to [0, 1], for which a small range far from zero does not
        lose its digits.
    scalar_range : tuple of float
    """
    lo, hi = volume.scalar_range
    well_conditioned = max(abs(lo), abs(hi)) / WELL_CONDITIONED <= hi - lo
    fits_float32 = well_conditioned and NARROWEST <= hi - lo <= WIDEST
    if volume.scalars.dtype in native and (volume.scalars.dtype.kind != "f" or fits_float32):
        return np.ascontiguousarray(volume.scalars), (lo, hi)
    scaled = np.empty(volume.scalars.shape, dtype=np.float32)
    # The extremes of float64 would overflow in hi - lo: halve first.
    span = hi / 2 - lo / 2
    for plane, out in zip(volume.scalars, scaled, strict=True):
        out[...] = (plane.astype(np.float64) / 2 - lo / 2) / span
    return scaled, (0.0, 1.0)
