"""A good first transfer function (TF), read off the volume's histogram."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from model.scene.scene import default_scalar_window
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.volume import Volume

MODE_AMPLITUDES = (0.04, 0.12, 0.4)
"""Opacities of modes that hold a typical share of the voxels, lowest value first."""

TYPICAL_SHARE = 0.1
"""Of the voxels in the scalar window, how many lie within a width of a typical mode's mean."""

MODE_COLORS = ((0.42, 0.68, 0.93), (0.97, 0.86, 0.55), (0.98, 0.58, 0.36))
"""Light blue, sand and orange: they stay apart in every common colour blindness."""

END_COLORS = ((0.03, 0.07, 0.2), (0.3, 0.05, 0.04))
"""Dark, as the ends of the random TFs are that generators are trained with."""


def default_transfer_function(volume: Volume) -> TransferFunction:
    """Three modes over the part of the scalar range where structure lies.

    The means divide the scalar window into parts that hold equal shares of the
    histogram, counted logarithmically so that rare values have their say.
    Opacity grows with the value and falls with the number of voxels that have
    it: what fills the volume must not hide the rest. A light colour sits at
    every mode.

    Parameters
    ----------
    volume : Volume

    Returns
    -------
    TransferFunction
        Over the volume's scalar range.
    """
    lo, hi = volume.scalar_range
    counts, edges = volume.histogram(256)
    centers = (edges[:-1] + edges[1:]) / 2
    window_lo, window_hi = default_scalar_window(volume)
    inside = (centers >= window_lo) & (centers <= window_hi)
    counts, centers = counts[inside], centers[inside]
    means = _balanced_means(counts, centers)
    width = float(min(np.diff(means).min() / 3, (hi - lo) / 24))
    modes = tuple(
        GaussianMode(mean, width, _amplitude(base, _share(counts, centers, mean, width)))
        for mean, base in zip(means, MODE_AMPLITUDES, strict=True)
    )
    colors = (END_COLORS[0], *MODE_COLORS, END_COLORS[1])
    stops = tuple((value, *color) for value, color in zip((lo, *means, hi), colors, strict=True))
    return TransferFunction(OpacityTF((lo, hi), modes), ColorTF((lo, hi), stops))


def _balanced_means(counts: NDArray[np.int64], centers: NDArray[np.float64]) -> list[float]:
    """Values with equal shares of log counts between them, one per mode."""
    # One more than each log count: an empty bin must not make the shares ambiguous.
    shares = np.cumsum(np.log1p(counts) + 1.0)
    number = len(MODE_AMPLITUDES)
    targets = shares[-1] * (np.arange(number) + 0.5) / number
    return [float(v) for v in np.interp(targets, shares, centers)]


def _share(
    counts: NDArray[np.int64], centers: NDArray[np.float64], mean: float, width: float
) -> float:
    """Share of the counted voxels that lie within a width of the mean."""
    return float(counts[np.abs(centers - mean) <= width].sum() / max(counts.sum(), 1))


def _amplitude(base: float, share: float) -> float:
    """Opacity of a mode: rarer values are shown more, between 0.02 and 0.7."""
    rarity = TYPICAL_SHARE / max(share, 1e-6)
    return round(min(max(base * rarity**0.5, 0.02), 0.7), 3)
