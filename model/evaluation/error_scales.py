"""Errors of a model by the scale of image details."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skimage.measure import block_reduce


@dataclass(frozen=True)
class ErrorScale:
    """Details of one scale: differences between means over blocks of one and of twice the size.

    Attributes
    ----------
    pixels : int
        Width of the smaller blocks in pixels; the image's width for the image mean.
    error : float
        Mean square, over all samples, of the details of the error.
    truth : float
        Mean square, over all samples, of the details of the true images.
    """

    pixels: int
    error: float
    truth: float


class ErrorScales:
    """Accumulates the mean squares of error details, image by image.

    Details of different scales are orthogonal (Haar 1910), so that their mean
    squares add up to that of the error.
    """

    def __init__(self) -> None:
        self._errors: dict[int, list[float]] = {}
        self._truths: dict[int, list[float]] = {}

    def add(self, image: NDArray[np.floating], truth: NDArray[np.floating]) -> None:
        """Add an image (S, S, channels) and its ground truth; S must be a power of two."""
        difference = image.astype(np.float64) - truth
        for sums, values in ((self._errors, difference), (self._truths, truth)):
            for pixels, square in _mean_squares(values).items():
                sums.setdefault(pixels, []).append(square)

    def scales(self) -> list[ErrorScale]:
        """Return all scales, from the finest details to the images' means."""
        return [
            ErrorScale(pixels, float(np.mean(errors)), float(np.mean(self._truths[pixels])))
            for pixels, errors in self._errors.items()
        ]


def _mean_squares(image: NDArray[np.floating]) -> dict[int, float]:
    """Mean square of an image's details, by block width in pixels."""
    found = {}
    pixels = 1
    while len(image) > 1:
        coarser = block_reduce(image, (2, 2, 1), np.mean)
        finer = image - coarser.repeat(2, axis=0).repeat(2, axis=1)
        found[pixels] = float(np.square(finer).mean())
        image = coarser
        pixels *= 2
    found[pixels] = float(np.square(image).mean())
    return found
