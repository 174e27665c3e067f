"""A good first transfer function (TF), read off the volume's histogram."""

from __future__ import annotations

import numpy as np

from model.scene import default_scalar_window
from model.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.volume import Volume

MODE_AMPLITUDES = (0.06, 0.22, 0.7)
"""Opacities of the modes, lowest value first: what few voxels have hides least."""

MODE_COLORS = ((0.42, 0.68, 0.93), (0.97, 0.86, 0.55), (0.98, 0.58, 0.36))
"""Light blue, sand and orange: they stay apart in every common colour blindness."""

END_COLORS = ((0.03, 0.07, 0.2), (0.3, 0.05, 0.04))
"""Dark, as the ends of the random TFs are that generators are trained with."""


def default_transfer_function(volume: Volume) -> TransferFunction:
    """Three modes over the part of the scalar range where structure lies.

    The means divide the scalar window into parts that hold equal shares of the
    histogram, counted logarithmically so that rare values have their say.
    Opacity grows with the value, and a light colour sits at every mode.

    Parameters
    ----------
    volume : Volume

    Returns
    -------
    TransferFunction
        Over the volume's scalar range.
    """
    lo, hi = volume.scalar_range
    means = _balanced_means(volume, len(MODE_AMPLITUDES))
    width = min(np.diff(means).min() / 3, (hi - lo) / 24)
    modes = tuple(
        GaussianMode(mean, float(width), amplitude)
        for mean, amplitude in zip(means, MODE_AMPLITUDES, strict=True)
    )
    colors = (END_COLORS[0], *MODE_COLORS, END_COLORS[1])
    stops = tuple((value, *color) for value, color in zip((lo, *means, hi), colors, strict=True))
    return TransferFunction(OpacityTF((lo, hi), modes), ColorTF((lo, hi), stops))


def _balanced_means(volume: Volume, count: int) -> list[float]:
    """Values in the scalar window with equal shares of log counts between them."""
    window_lo, window_hi = default_scalar_window(volume)
    counts, edges = volume.histogram(256)
    centers = (edges[:-1] + edges[1:]) / 2
    inside = (centers >= window_lo) & (centers <= window_hi)
    # One more than each log count: an empty bin must not make the shares ambiguous.
    shares = np.cumsum(np.log1p(counts[inside]) + 1.0)
    targets = shares[-1] * (np.arange(count) + 0.5) / count
    return [float(v) for v in np.interp(targets, shares, centers[inside])]
