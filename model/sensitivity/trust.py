"""Trust in learned sensitivities: how far they agree with exact ones, here and now."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

Trust = Literal["good", "fair", "poor"]

GOOD, FAIR = 0.9, 0.7
"""Least cosine of good and of fair agreement."""

BEST_TRUST = 2
"""Highest of the levels of trust."""

NEIGHBORHOOD = 1 / 64
"""Standard deviation of the neighbourhoods that are compared, relative to the image."""


def trust_word(agreement: float) -> Trust:
    """Return the word for a cosine of learned and exact sensitivities."""
    return "good" if agreement >= GOOD else "fair" if agreement >= FAIR else "poor"


def trust_levels(
    learned: NDArray[np.floating], exact: NDArray[np.floating], size: int
) -> NDArray[np.int64]:
    """Compare two fields of changes around each pixel.

    Parameters
    ----------
    learned, exact : ndarray, shapes (S, S, 3) and (T, T, 3)
        Changes of the colours by the same edit.
    size : int
        Width and height of the result.

    Returns
    -------
    ndarray of int64, shape (size, size)
        2 where the cosine of both around the pixel is good, 1 where fair, 0 where poor.
        Where both are negligible they agree.
    """
    # Imported here: the window starts without it.
    from scipy.ndimage import gaussian_filter

    a, b = _at_one_size(learned, exact)
    sigma = NEIGHBORHOOD * len(a)
    dot, square_a, square_b = (
        gaussian_filter((x * y).sum(axis=-1), sigma) for x, y in ((a, b), (a, a), (b, b))
    )
    negligible = 1e-4 * max(square_a.max(), square_b.max(), 1e-30)
    local = (dot + negligible) / (np.sqrt(square_a * square_b) + negligible)
    levels = (local >= FAIR).astype(np.int64) + (local >= GOOD)
    nearest = (np.arange(size) + 0.5) * len(levels) // size
    at = nearest.astype(int)
    return np.asarray(levels[np.ix_(at, at)])


def _at_one_size(
    one: NDArray[np.floating], other: NDArray[np.floating]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # Imported here: the window starts without it.
    from skimage.transform import resize

    size = min(len(one), len(other))
    a, b = (
        resize(field.astype(np.float64), (size, size, 3), order=1, anti_aliasing=True)
        if len(field) != size
        else field.astype(np.float64)
        for field in (one, other)
    )
    return a, b
