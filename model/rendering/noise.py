"""Noise of a volume's voxels, below which differences between them are no surface."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

SAMPLES = 1 << 15  # voxels that are looked at, drawn at random, the same ones each time

BINS, WIDE = 32, 4
"""Bins of values, of which so many in a row may be a material with noise of its own."""

MATERIAL = 0.05  # share of the voxels from which on these count as a material

QUARTILE = 0.31864
"""Size that a quarter of normally distributed numbers stay below, in standard deviations."""

LABEL_NOISE = 0.02
"""In place of noise, for a label's share of what is around: deep inside it has no direction."""

_WEIGHTS = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


def noise_of(scalars: NDArray[Any]) -> float:
    """Estimate the standard deviation of the voxels' noise, in their own units.

    It is read off fourth differences, in which smooth structures cancel. The lower quartile of
    their size ignores surfaces, in each range of values apart: air, which fills most scans, may
    have less noise than material. The noisiest material counts.
    """
    random = np.random.default_rng(0)
    values, sizes = [], []
    for axis, length in enumerate(scalars.shape):
        if length < len(_WEIGHTS):
            continue
        places = [random.integers(0, n, SAMPLES) for n in scalars.shape]
        places[axis] = random.integers(2, length - 2, SAMPLES)
        total, mean = np.zeros(SAMPLES), np.zeros(SAMPLES)
        for offset, weight in zip(range(-2, 3), _WEIGHTS, strict=True):
            at = tuple(p + offset * (n == axis) for n, p in enumerate(places))
            scalar = scalars[at].astype(np.float64)
            total += weight * scalar
            mean += scalar / len(_WEIGHTS)
        values.append(mean)
        sizes.append(np.abs(total) / np.sqrt((_WEIGHTS**2).sum()))
    if not values:
        return 0.0
    value, size = np.concatenate(values), np.concatenate(sizes)
    # A few outliers would leave the materials a single bin.
    lo, hi = np.quantile(value, [0.005, 0.995])
    if not hi > lo:
        return float(np.quantile(size, 0.25)) / QUARTILE
    in_bin = np.clip((value - lo) / (hi - lo) * BINS, 0, BINS - 1).astype(np.int64)
    quartiles = []
    for first in range(BINS - WIDE + 1):
        inside = size[(in_bin >= first) & (in_bin < first + WIDE)]
        if len(inside) >= MATERIAL * len(value):
            quartiles.append(float(np.quantile(inside, 0.25)))
    return max(quartiles, default=float(np.quantile(size, 0.25))) / QUARTILE
