"""The scalar values that contribute to a place of the image: "what did I click on?"."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from model.scene.transfer_function import TF_SAMPLES, Range
from model.sensitivity.peaks import find_peaks

SMOOTHING = 3.0
"""Standard deviation of the smoothing, in bins, so that noise is not many values."""

LEAST_SHARE = 0.05
"""Share of the place's visibility from which a value is named."""


@dataclass(frozen=True)
class Contribution:
    """A scalar value that shows at a place of the image.

    Attributes
    ----------
    value : float
        In the data's units.
    share : float
        Its share, with the values around it, of the place's visibility, 0 to 1.
    """

    value: float
    share: float


def contributions(
    visibility: NDArray[np.floating], scalar_range: Range, count: int = 3
) -> tuple[Contribution, ...]:
    """Find the values that contribute most to a place.

    Parameters
    ----------
    visibility : ndarray, shape (256,)
        Of each scalar value at the place; see :func:`model.sensitivity.exact.visibility`.
    scalar_range : tuple of float
    count : int
        Largest number of values.

    Returns
    -------
    tuple of Contribution
        Each peak with the values up to the next valleys, the largest share first; none for
        a black place.
    """
    total = float(visibility.sum())
    if not total > 1e-6:
        return ()
    # Imported here: the window starts without it.
    from scipy.ndimage import gaussian_filter1d

    smooth = np.pad(gaussian_filter1d(visibility.astype(np.float64), SMOOTHING, mode="nearest"), 1)
    peaks = [peak.place for peak in find_peaks(smooth, 0.02 * float(smooth.max()))]
    valleys = [int(np.argmin(smooth[a : b + 1])) + a for a, b in pairwise(peaks)]
    edges = [0, *(valley - 1 for valley in valleys), TF_SAMPLES]
    values = np.linspace(*scalar_range, TF_SAMPLES)
    shares = [float(visibility[first:last].sum()) / total for first, last in pairwise(edges)]
    found = [
        Contribution(float(values[peak - 1]), share)
        for peak, share in zip(peaks, shares, strict=True)
        if share >= LEAST_SHARE
    ]
    return tuple(sorted(found, key=lambda one: -one.share)[:count])
