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
        The volume's scalars unchanged if their type is native and can be clamped to the
        scalar range exactly (and, for floats, is well conditioned); otherwise a float32 copy
        mapped to [0, 1], so that a small range far from zero keeps its precision.
    scalar_range : tuple of float
        The volume's scalar range in the units of these scalars, none of which lies beyond.
    """
    lo, hi = volume.scalar_range
    well_conditioned = max(abs(lo), abs(hi)) / WELL_CONDITIONED <= hi - lo
    fits_float32 = well_conditioned and NARROWEST <= hi - lo <= WIDEST
    kind = volume.voxels.dtype
    fits = fits_float32 if kind.kind == "f" else _clamps_exactly(volume)
    if kind in native and fits:
        return np.ascontiguousarray(volume.scalars), (lo, hi)
    scaled = np.empty(volume.voxels.shape, dtype=np.float32)
    for plane, out in zip(unit_planes(volume), scaled, strict=True):
        out[...] = plane
    return scaled, (0.0, 1.0)


def unit_planes(volume: Volume) -> Iterator[NDArray[np.float64]]:
    """Yield a volume's planes along z with the scalar range mapped to [0, 1], one at a time.

    Values beyond the scalar range become 0 or 1.
    """
    lo, hi = volume.scalar_range
    # The extremes of float64 would overflow in hi - lo: halve first.
    span = hi / 2 - lo / 2
    for plane in volume.voxels:
        values = plane.astype(np.float64)
        yield (np.clip(values, lo, hi, out=values) / 2 - lo / 2) / span


def _clamps_exactly(volume: Volume) -> bool:
    """Whether integers can be clamped to the scalar range: where it ends at whole numbers."""
    (lo, hi), (lowest, highest) = volume.scalar_range, volume.data_range
    return (lo <= lowest or lo.is_integer()) and (highest <= hi or hi.is_integer())
