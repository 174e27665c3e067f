"""The scale of the scalar axis: a volume's values, or their decimal logarithms.

On a logarithmic scale voxels, TFs, scalar ranges and histograms are all logarithms, so that
renderers, derivatives and models need no special case. This module converts values for users.
"""

import math
from typing import Any, Literal, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from model.scene.distribution import Distribution
from model.threads import in_threads

ValueScale = Literal["linear", "log"]  # values, or their decimal logarithms

SCALE_NAMES: dict[ValueScale, str] = {
    "linear": "the values as they are",
    "log": "the logarithm of the values",
}
"""Names of the axis's values, for sentences."""

LOGARITHM_OFFER = (
    "nearly all values lie in the lowest hundredth of their range, and a logarithmic scale would "
    "spread them out"
)
"""Reason for offering a logarithmic scale; see :func:`suits_logarithm`."""

SMALL_PART = 0.01  # lower share of the range that must have nearly all values for the offer
MOST = 0.95  # share of the positive values that counts as nearly all
FEW_NEGATIVE = 0.01  # largest share of voxels below zero for the offer

LEAST_RATIO = 30.0
"""Ratio of large to small values, without a hundredth at each end, from which the logarithm shows
more than a narrower range would."""

_FARTHEST = 307.0  # logarithms farther from 0 overflow


def value_at(place: float, scale: ValueScale) -> float:
    """Return the value, in the data's units, of a place on a scale."""
    return float(values_at(place, scale))


def values_at(places: ArrayLike, scale: ValueScale) -> NDArray[np.float64]:
    """Return the values, in the data's units, of places on a scale."""
    at = np.asarray(places, dtype=np.float64)
    return at if scale == "linear" else np.power(10.0, np.clip(at, -_FARTHEST, _FARTHEST))


def place_of(value: float, scale: ValueScale) -> float:
    """Return the place on a scale of a value in the data's units; ValueError if it has none."""
    return value if scale == "linear" else math.log10(value)


def logarithms(
    voxels: NDArray[np.generic], distribution: Distribution
) -> NDArray[np.floating] | None:
    """Decimal logarithms of voxels, of the least positive for those below; None without any."""
    lowest, highest = distribution.range
    if highest <= 0:
        return None
    if lowest <= 0:
        most = distribution.ends[1]
        lowest = min(distribution.of_planes(lambda plane: plane[plane > 0].min(initial=most)))
    wide = voxels.dtype.itemsize > 4
    found = np.empty(voxels.shape, np.float64 if wide else np.float32)

    def fill(z: int) -> None:
        positive = np.maximum(cast(NDArray[Any], voxels[z]), lowest, dtype=np.float64)
        np.log10(positive, out=found[z], casting="same_kind")

    in_threads(fill, range(len(voxels)))
    return found


def share_without_logarithm(distribution: Distribution) -> float:
    """Fraction of the voxels that are at most zero, 0 to 1, estimated from a sample."""
    found, counts = distribution.frequencies
    return float(counts[found.astype(np.float64) <= 0].sum() / counts.sum())


def suits_logarithm(distribution: Distribution) -> bool:
    """Whether a logarithmic scale shows more than a linear one.

    It does if nearly all positive values are in the lowest hundredth of the range, over orders of
    magnitude, and hardly any is negative. Zeros, which often surround the data, do not count.
    """
    found, counts = distribution.frequencies
    values = found.astype(np.float64)
    positive = values > 0
    if not positive.any() or counts[values < 0].sum() > FEW_NEGATIVE * counts.sum():
        return False
    lo, hi = distribution.range
    values, counts = values[positive], counts[positive]
    upto = np.cumsum(counts) / counts.sum()
    in_part = counts[values <= max(lo, 0.0) + SMALL_PART * (hi - max(lo, 0.0))].sum()
    small, large = (values[np.searchsorted(upto, share)] for share in (0.01, 0.99))
    return bool(in_part >= MOST * counts.sum() and large >= LEAST_RATIO * small)


def logarithmic_ticks(places: tuple[float, float], count: int = 6) -> list[tuple[float, str]]:
    """Choose round values to label between two places on a logarithmic scale.

    They are powers of ten, or 2 and 5 times these, if there are at least three; else evenly spaced.
    Each has its place, from 0 at the lower end to 1 at the upper one, and its text.
    """
    lo, hi = places
    powers = np.arange(math.ceil(lo - 1e-9), math.floor(hi + 1e-9) + 1)
    if len(powers) >= 3:
        every = -(-len(powers) // count)
        values = [value_at(float(power), "log") for power in powers if power % every == 0]
    else:
        tens = range(math.floor(lo) - 1, math.ceil(hi) + 1)
        values = [factor * value_at(power, "log") for power in tens for factor in (1, 2, 5)]
    found = [((math.log10(value) - lo) / (hi - lo), f"{value:g}") for value in values]
    found = [tick for tick in found if -1e-9 <= tick[0] <= 1 + 1e-9]
    if len(found) >= 3:
        return found
    first, last = values_at(places, "log")
    rough = (last - first) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= 0.999 * rough)
    digits = max(6, 3 + math.floor(math.log10(last / step)))
    marks = step * np.arange(math.ceil(first / step - 1e-9), math.floor(last / step + 1e-9) + 1)
    return [((math.log10(mark) - lo) / (hi - lo), f"{mark:.{digits}g}") for mark in marks]
