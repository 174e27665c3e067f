"""A path-traced picture as far as it is drawn, and how wrong it may be."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Estimate:
    """A picture as far as it is drawn.

    Attributes
    ----------
    rgba : ndarray of float32, shape (rows, columns, 4)
        As renderers return it.
    samples : int
        Of each pixel.
    error : float
        Estimated standard error of the colours: root mean square over all pixels, from the
        difference of two independent halves of the samples; infinite after the first.
    radiance : ndarray of float32, shape (rows, columns, 3)
        Colours before they are cut at 1, times opacity: what a denoiser needs.
    albedo : ndarray of float32, shape (rows, columns, 3)
        Unlit colours, times opacity. They have no noise.
    halves : ndarray of float32, shape (2, rows, columns, 3)
        Radiance of the even and of the odd samples, independent of each other; after the first
        sample the second is 0.
    """

    rgba: NDArray[np.float32]
    samples: int
    error: float
    radiance: NDArray[np.float32]
    albedo: NDArray[np.float32]
    halves: NDArray[np.float32]


def estimate_of(
    sums: NDArray[np.float32],
    unlit: NDArray[np.float32],
    samples: int,
) -> Estimate:
    """Return the estimate from sums over samples.

    Parameters
    ----------
    sums : ndarray of float32, shape (2, rows, columns, 3)
        Of the radiance of the even and of the odd samples.
    unlit : ndarray of float32, shape (rows, columns, 4)
        The ray caster's unlit picture.
    samples : int
    """
    counts = (samples + 1) // 2, samples // 2
    radiance = (sums[0] + sums[1]) / np.float32(samples)
    rgba = np.clip(np.concatenate([radiance, unlit[..., 3:]], axis=2), 0, 1)
    halves = np.stack([sums[0] / counts[0], sums[1] / max(counts[1], 1)]).astype(np.float32)
    error = math.inf
    if samples > 1:
        # Halves of n1 and n2 samples differ with the variance s (1 / n1 + 1 / n2) = s n / n1 n2.
        share = math.sqrt(counts[0] * counts[1]) / samples
        error = share * math.sqrt(mean_square(halves[0] - halves[1]))
    albedo = np.ascontiguousarray(unlit[..., :3])
    return Estimate(rgba, samples, error, radiance, albedo, halves)


def mean_square(values: NDArray[np.float32]) -> float:
    """Mean of squares, summed in 64 bits."""
    return float(np.mean(values.astype(np.float64) ** 2))
