"""Scalar ranges that a few outliers or a long thin tail do not widen."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import VolumeError
from model.scene.distribution import Distribution, Range
from model.scene.volume import Volume

TAIL = 0.001
"""Share of the voxels at each end that does not decide about the range."""

SQUEEZED = 8
"""The range is narrowed where the voxels but for the tails would fill less than 1/8 of it."""

ROOM = 1.0
"""How far a narrowed range may reach beyond the voxels without tails, in widths of these."""


def percentile_range(volume: Volume, low: float, high: float) -> Range:
    """Return the values below which `low` and `high` per cent of the voxels lie.

    Parameters
    ----------
    volume : Volume
        All its voxels count but the missing ones, also those beyond its scalar range.
    low, high : float
        0 to 100; these two give the smallest and the largest voxel.

    Raises
    ------
    VolumeError
        When the percentages are out of order, or the two values are the same.
    """
    if not 0 <= low < high <= 100:
        raise VolumeError(
            f"{volume.name}: {low:g} and {high:g} are no range of percentiles; "
            "give two numbers from 0 to 100, the lower one first."
        )
    values, counts = volume.distribution.frequencies
    lo, hi = _quantiles(values, counts, low / 100, high / 100)
    lowest, highest = volume.data_range
    # Of many voxels only a sample is looked at, in which the outermost are missing.
    lo, hi = (lowest if low == 0 else lo), (highest if high == 100 else hi)
    if lo == hi:
        raise VolumeError(
            f"{volume.name}: between {low:g} and {high:g} per cent all voxels are {lo:g}; "
            "choose percentiles that lie farther apart."
        )
    return lo, hi


def robust_range(volume: Volume) -> Range:
    """Return the range of the voxels without a few outliers, a long thin tail, or a fill value.

    It is that of all voxels in most volumes: in all where the voxels but for a thousandth at
    either end take at least an eighth of it, 32 of a TF's 256 bins. Otherwise an end that lies
    farther out than the width of these voxels' range is moved in, to the outermost voxel
    within that distance. So even thin tails are kept where there is room for them, and most of
    a narrowed range is used.

    The most frequent value, mostly air or what is written where nothing was measured, does not
    count among the voxels of which a thousandth is left out: there may be few others. The range
    holds it all the same unless it lies so far off that the others would fill less than an
    eighth of the range. Then an eighth of the others' width is left free on its side, so that
    it remains something else than the outermost of them.

    Parameters
    ----------
    volume : Volume
        All its voxels count but the missing ones, also those beyond its scalar range.
    """
    lowest, highest = volume.data_range
    values, counts = volume.distribution.frequencies
    frequent = int(counts.argmax())
    common, is_common = float(values[frequent]), counts[frequent] > TAIL * counts.sum()
    lo, hi, fill = lowest, highest, None
    others = np.arange(len(values)) != frequent if is_common else np.ones(len(values), bool)
    if others.any():
        lo, hi = _without_tails(values[others], counts[others])
    if is_common:
        with_common = min(lo, common), max(hi, common)
        if lo < hi and (with_common[1] - with_common[0]) > SQUEEZED * (hi - lo):
            fill = common
        else:
            lo, hi = with_common
    width = hi - lo
    if width == 0 or highest - lowest <= SQUEEZED * width:
        return lowest, highest
    near_lo, near_hi = _outermost(volume.distribution, lo - ROOM * width, hi + ROOM * width)
    if fill is not None and fill < near_lo:
        near_lo -= width / SQUEEZED
    elif fill is not None and fill > near_hi:
        near_hi += width / SQUEEZED
    if volume.distribution.is_whole:
        near_lo, near_hi = float(np.floor(near_lo)), float(np.ceil(near_hi))
    return max(near_lo, lowest), min(near_hi, highest)


def _without_tails(values: NDArray[np.generic], counts: NDArray[np.int64]) -> Range:
    """Range of the values without a thousandth of their number, and at least one, at each end."""
    share = max(TAIL, 1.5 / counts.sum())
    return (
        _quantiles(values, counts, share, 1 - share)
        if share < 0.5
        else (float(values[0]), float(values[-1]))
    )


def _quantiles(
    values: NDArray[np.generic], counts: NDArray[np.int64], low: float, high: float
) -> Range:
    """Values, none between two of them, below or at which these shares of their number lie."""
    upto = np.cumsum(counts)
    places = np.searchsorted(upto, [low * upto[-1], high * upto[-1]])
    lo, hi = (float(values[place]) for place in places)
    return lo, hi


def _outermost(distribution: Distribution, lo: float, hi: float) -> Range:
    """Smallest and largest voxel from `lo` to `hi`."""
    lowest, highest = np.inf, -np.inf
    for counted in distribution.planes():
        plane: NDArray[Any] = counted
        inside = plane[(plane >= lo) & (plane <= hi)]
        if inside.size:
            lowest, highest = min(lowest, float(inside.min())), max(highest, float(inside.max()))
    return lowest, highest
