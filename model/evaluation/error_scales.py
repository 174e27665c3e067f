"""How coarse or fine the details are that a model draws poorly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skimage.measure import block_reduce


@dataclass(frozen=True)
class ErrorScale:
    """Details of one size: what block means over so many pixels add to those over twice as many.

    Attributes
    ----------
    pixels : int
        Edge of the blocks; the image's for its mean.
    error : float
        Mean square, over all samples, of the error's details.
    truth : float
        The same of the true images' details.
    """

    pixels: int
    error: float
    truth: float


class ErrorScales:
    """Sums up the details of errors, image by image.

    The details of different sizes are orthogonal (Haar 1910): their mean
    squares add up to that of the error.
    """

    def __init__(self) -> None:
        self._errors: dict[int, list[float]] = {}
        self._truths: dict[int, list[float]] = {}

    def add(self, image: NDArray[np.floating], truth: NDArray[np.floating]) -> None:
        """Count an image (S, S, channels), S a power of two, and the true one."""
        difference = image.astype(np.float64) - truth
        for sums, values in ((self._errors, difference), (self._truths, truth)):
            for pixels, square in _mean_squares(values).items():
                sums.setdefault(pixels, []).append(square)

    def scales(self) -> list[ErrorScale]:
        """The finest details first, the images' means last."""
        return [
            ErrorScale(pixels, float(np.mean(errors)), float(np.mean(self._truths[pixels])))
            for pixels, errors in self._errors.items()
        ]


def _mean_squares(image: NDArray[np.floating]) -> dict[int, float]:
    """Mean square of an image's details, by their size in pixels."""
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
