"""Opacity TFs given by many samples, as a curve of few points or as Gaussian modes.

Both have as many handles as a user can move; how far they are from the samples is returned.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from model.scene.random_tfs import MAX_MODES
from model.scene.transfer_function import TF_SAMPLES, GaussianMode, OpacityTF

CURVE_ERROR = 0.02
"""Largest difference in the square root of opacity between samples and a curve of few points.

The root, as a faint haze over many values is seen where a small difference at a peak is not.
"""

LEAST_AMPLITUDE = 0.004
"""Opacity below which no mode is fitted: one step of an 8-bit image."""


def fitted_curve(opacity: OpacityTF) -> OpacityTF:
    """Return a free curve of few points through the samples of one with many.

    Points are added where the curve is farthest from the samples (Ramer, Douglas, Peucker, with
    differences in opacity alone).
    """
    if len(opacity.points) < 3:
        return opacity
    values, heights = np.array(opacity.points).T
    kept = {0, len(values) - 1}
    # A jump, two points at one value, stays a jump.
    jumps = np.flatnonzero(np.diff(values) == 0)
    kept.update(jumps.tolist(), (jumps + 1).tolist())
    ends = sorted(kept)
    open_parts = [*pairwise(ends)]
    while open_parts:
        first, last = open_parts.pop()
        if last - first < 2:
            continue
        inside = slice(first + 1, last)
        line = np.interp(values[inside], values[[first, last]], heights[[first, last]])
        errors = np.abs(np.sqrt(heights[inside]) - np.sqrt(line))
        if errors.max() > CURVE_ERROR:
            middle = first + 1 + int(errors.argmax())
            kept.add(middle)
            open_parts += [(first, middle), (middle, last)]
    points = tuple(opacity.points[index] for index in sorted(kept))
    return replace(opacity, points=points)


def fitted_modes(opacity: OpacityTF) -> OpacityTF:
    """Return Gaussian modes that come near an opacity TF; none where it shows hardly anything.

    Modes are added where most is missing, and all of them fitted together after each, by
    least squares with a soft loss: a plateau's edges, which no mode can follow, do not pull
    the others away.
    """
    from scipy.optimize import least_squares

    wanted = opacity.sample().astype(np.float64)
    bins = np.arange(TF_SAMPLES, dtype=np.float64)
    # Means, widths (both in bins) and amplitudes, one row per mode.
    modes = np.empty((0, 3))
    for _ in range(MAX_MODES):
        missing = wanted - _sum(modes, bins)
        if missing.max() < LEAST_AMPLITUDE:
            break
        modes = np.concatenate([modes, _guess(missing)])
        lowest = np.tile([-TF_SAMPLES / 2, 1.0, 0.0], len(modes))
        highest = np.tile([1.5 * TF_SAMPLES, 2.0 * TF_SAMPLES, 1.0], len(modes))
        found = least_squares(
            lambda x: _sum(x.reshape(-1, 3), bins) - wanted,
            modes.ravel().clip(lowest + 1e-6, highest - 1e-6),
            bounds=(lowest, highest),
            x_scale=np.tile([10.0, 10.0, 0.1], len(modes)),
            loss="soft_l1",
            f_scale=0.05,
            max_nfev=60,
        )
        better = found.x.reshape(-1, 3)
        modes = better[better[:, 2] >= LEAST_AMPLITUDE / 2]
    lo, hi = opacity.scalar_range
    unit = (hi - lo) / (TF_SAMPLES - 1)
    return replace(
        opacity,
        modes=tuple(
            GaussianMode(lo + unit * mean, unit * width, amplitude)
            for mean, width, amplitude in sorted(modes.tolist())
        ),
        points=(),
    )


def _sum(modes: NDArray[np.float64], bins: NDArray[np.float64]) -> NDArray[np.float64]:
    means, widths, amplitudes = modes.T[:, :, None]
    return np.asarray((amplitudes * np.exp(-(((bins - means) / widths) ** 2))).sum(axis=0))


def _guess(missing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mode (1, 3) at the largest of what is missing, as wide as half of it."""
    peak = int(missing.argmax())
    low = missing < missing[peak] / 2
    left = peak - next((i for i in range(1, peak + 1) if low[peak - i]), peak)
    right = peak + next(
        (i for i in range(1, TF_SAMPLES - peak) if low[peak + i]), TF_SAMPLES - peak
    )
    width = max((right - left) / (2 * np.sqrt(np.log(2))), 1.5)
    return np.array([[(left + right) / 2, width, missing[peak]]])
