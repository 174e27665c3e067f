"""Conversion of the volume's scalars to a type that a renderer supports."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import Range
from model.scene.volume import Volume

WELL_CONDITIONED = 256.0
"""Largest ratio of absolute values to their range for which float32 is used unchanged.

At this ratio rounding errors are 1/256 of a TF bin.
"""

NARROWEST, WIDEST = 1e-30, 1e30
"""Limits of the range of values for which float32 can hold differences and reciprocals."""


def renderable_scalars(
    volume: Volume, native: tuple[type[np.generic], ...]
) -> tuple[NDArray[Any], Range]:
    """Return scalars for a renderer, and their range.

    Parameters
    ----------
    volume : Volume
    native : tuple of scalar types
        Types that the renderer supports directly.

    Returns
    -------
    scalars : ndarray, shape (nz, ny, nx)
        The volume's values unchanged if their type is native (and, for floats, well
        conditioned); otherwise a float32 copy mapped to [0, 1], so that a small
        range far from zero keeps its precision.
    scalar_range : tuple of float
        Smallest and largest of these scalars.
    """
    lo, hi = volume.scalar_range
    well_conditioned = max(abs(lo), abs(hi)) / WELL_CONDITIONED <= hi - lo
    fits_float32 = well_conditioned and NARROWEST <= hi - lo <= WIDEST
    if volume.scalars.dtype in native and (volume.scalars.dtype.kind != "f" or fits_float32):
        return np.ascontiguousarray(volume.scalars), (lo, hi)
    scaled = np.empty(volume.scalars.shape, dtype=np.float32)
    for plane, out in zip(unit_planes(volume), scaled, strict=True):
        out[...] = plane
    return scaled, (0.0, 1.0)


def unit_planes(volume: Volume) -> Iterator[NDArray[np.float64]]:
    """Yield a volume's planes along z with the scalar range mapped to [0, 1], one at a time."""
    lo, hi = volume.scalar_range
    # The extremes of float64 would overflow in hi - lo: halve first.
    span = hi / 2 - lo / 2
    for plane in volume.scalars:
        yield (plane.astype(np.float64) / 2 - lo / 2) / span
