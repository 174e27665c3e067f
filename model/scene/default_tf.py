"""A default transfer function (TF), derived from the volume's histogram."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from model.scene.scene import default_scalar_window
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.volume import Volume

MODE_AMPLITUDES = (0.04, 0.12, 0.5)
"""Opacities of modes that cover a typical fraction of the voxels, lowest value first."""

TYPICAL_SHARE = 0.1
"""Fraction of the scalar window's voxels within one width of a typical mode's mean."""

MODE_COLORS = ((0.42, 0.68, 0.93), (0.97, 0.86, 0.55), (0.98, 0.58, 0.36))
"""Light blue, sand and orange, distinguishable with all common colour blindnesses."""

END_COLORS = ((0.03, 0.07, 0.2), (1.0, 0.93, 0.8))
"""Dark blue for the lowest values, which are hardly shown, and ivory for the highest."""

SEEN_OPACITY = 0.9
"""Opacity that half of the rays through what the TF shows should have at least."""

OPAQUE_RAY = 0.5
"""Opacity from which a ray counts as one through what the TF shows, with modes at their highest."""

MOST_FACTOR, FACTORS = 32.0, 41
"""Largest factor by which optical depths are raised, and how many are tried in equal ratios."""

LEAST_AMPLITUDE, MOST_AMPLITUDE = 0.02, 0.9
"""Limits of the opacities of modes."""


def default_transfer_function(volume: Volume) -> TransferFunction:
    """Return a TF of three modes over the scalar window, with a light colour at each mode.

    The means divide the scalar window by equal fractions of the log-scaled
    histogram, so that rare values count as well. Opacity increases with the
    value and decreases with the number of voxels near it, so that frequent
    values do not hide the others. The highest mode is wide enough for all values above it.
    Where the image would be faint nevertheless, all opacities are raised, see
    :data:`SEEN_OPACITY`.

    Returns
    -------
    TransferFunction
        Defined over the volume's scalar range.
    """
    lo, hi = volume.scalar_range
    counts, edges = volume.histogram(256)
    window_lo, window_hi = default_scalar_window(volume)
    # Bins that lie partly in the window are cut, so that a few wide ones do, too.
    inside = (edges[1:] > window_lo) & (edges[:-1] < window_hi)
    counts, starts, ends = counts[inside], edges[:-1][inside], edges[1:][inside]
    starts, ends = np.maximum(starts, window_lo), np.minimum(ends, window_hi)
    centers = (starts + ends) / 2
    means = _balanced_means(counts, np.append(starts, ends[-1]))
    width = float(min(np.diff(means).min() / 3, (hi - lo) / 24))
    # Halfway to the window's end, the highest mode still has a third of its opacity; but it
    # must not cover the one below.
    widest = max(width, 0.4 * (means[-1] - means[-2]), 0.5 * (window_hi - means[-1]))
    modes = tuple(
        GaussianMode(mean, wide, _amplitude(base, _share(counts, centers, mean, wide)))
        for mean, wide, base in zip(means, (width, width, widest), MODE_AMPLITUDES, strict=True)
    )
    opacity = _raised(OpacityTF((lo, hi), modes, scale=volume.scale), ThinnedVolume.of(volume))
    colors = (END_COLORS[0], *MODE_COLORS, END_COLORS[1])
    stops = tuple((value, *color) for value, color in zip((lo, *means, hi), colors, strict=True))
    return TransferFunction(opacity, ColorTF((lo, hi), stops))


def _balanced_means(counts: NDArray[np.int64], edges: NDArray[np.float64]) -> list[float]:
    """Return values, one per mode, that are spaced evenly in the cumulative log counts."""
    # Adding 1 keeps the cumulative counts strictly increasing across empty bins.
    shares = np.concatenate([[0.0], np.cumsum(np.log1p(counts) + 1.0)])
    number = len(MODE_AMPLITUDES)
    targets = shares[-1] * (np.arange(number) + 0.5) / number
    return [float(v) for v in np.interp(targets, shares, edges)]


def _share(
    counts: NDArray[np.int64], centers: NDArray[np.float64], mean: float, width: float
) -> float:
    """Fraction of the counted voxels within one width of the mean."""
    return float(counts[np.abs(centers - mean) <= width].sum() / max(counts.sum(), 1))


def _amplitude(base: float, share: float) -> float:
    """Opacity of a mode, higher for rarer values, within the limits."""
    rarity = TYPICAL_SHARE / max(share, 1e-6)
    return round(min(max(base * rarity**0.5, LEAST_AMPLITUDE), MOST_AMPLITUDE), 3)


def _raised(opacity: OpacityTF, volume: ThinnedVolume) -> OpacityTF:
    """Return the TF with its opacities raised until what it shows is seen, if it is not."""
    through = volume.ray_opacities(_times(opacity, MOST_FACTOR)) > OPAQUE_RAY
    if not through.any():
        return opacity

    def is_seen(factor: float) -> bool:
        rays = volume.ray_opacities(_times(opacity, factor))[through]
        return bool(np.median(rays) >= SEEN_OPACITY)

    factors = np.geomspace(1.0, MOST_FACTOR, FACTORS)
    return _times(opacity, float(factors[bisect_left(factors, True, hi=FACTORS - 1, key=is_seen)]))


def _times(opacity: OpacityTF, factor: float) -> OpacityTF:
    """Return the TF with optical depths of its modes multiplied by a factor, within the limits."""
    modes = tuple(
        replace(m, amplitude=round(min(1 - (1 - m.amplitude) ** factor, MOST_AMPLITUDE), 3))
        for m in opacity.modes
    )
    return replace(opacity, modes=modes)
