"""A path-traced picture after some samples per pixel, and its estimated error."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster

LEAST = np.float32(1e-3)
"""Opacity of a pixel below which nothing is traced: less than a quarter of an 8-bit step."""

MARGIN, UNIT = 32, 64
"""Margin in pixels around the traced part that a cleaner gets; and the number of which its position
and size are multiples, so that few sizes occur: each needs a filter of its own."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """A picture after some samples per pixel."""

    rgba: NDArray[np.float32]  # as renderers return it, shape (rows, columns, 4)
    samples: int  # of each pixel
    error: float
    """Estimated standard error of the colours: root mean square over all pixels, from the
    difference of two independent halves of the samples; infinite after the first."""
    radiance: NDArray[np.float32]  # colours before they are cut at 1, times opacity
    albedo: NDArray[np.float32]  # unlit colours, times opacity; they have no noise
    halves: NDArray[np.float32]
    """Radiance of the even and of the odd samples, independent of each other; after the first
    sample the second is 0. Shape (2, rows, columns, 3)."""

    @property
    def counts(self) -> NDArray[np.int64]:
        """Number of the even and of the odd samples."""
        return np.array([(self.samples + 1) // 2, self.samples // 2])

    def traced_part(self, raster: Raster) -> Raster:
        """Return the part of a picture, given its raster, that contains all traced pixels."""
        traced = self.rgba[..., 3] >= LEAST
        ends = []
        for axis, length in enumerate(raster.shape):
            (places,) = np.nonzero(traced.any(axis=1 - axis))
            first, last = (places[0], places[-1]) if len(places) else (0, 0)
            low = max(int(first) - MARGIN, 0) // UNIT * UNIT
            high = min(-(-(int(last) + 1 + MARGIN) // UNIT) * UNIT, length)
            ends.append((low, high - low))
        (top, rows), (left, columns) = ends
        return replace(
            raster, left=raster.left + left, top=raster.top + top, columns=columns, rows=rows
        )

    def cut(self, rows: slice, columns: slice) -> Estimate:
        """Return the estimate of some rows and columns."""
        parts = {
            name: getattr(self, name)[rows, columns] for name in ("rgba", "radiance", "albedo")
        }
        return replace(self, **parts, halves=self.halves[:, rows, columns])


def estimate_of(sums: NDArray[np.float32], unlit: NDArray[np.float32], samples: int) -> Estimate:
    """Return the estimate from sums over samples."""
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
