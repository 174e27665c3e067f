"""Pictures of few samples made clean, and how wrong they are then."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from model.rendering.path_tracing.denoising import denoise
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs


class Cleaner(Protocol):
    """Takes the noise out of the estimates of one picture.

    Attributes
    ----------
    doubling : float
        Factor of a clean picture's error for twice the samples, on average.
    """

    doubling: float

    def clean(
        self, radiance: NDArray[np.float32], estimate: Estimate, samples: int
    ) -> NDArray[np.float32]:
        """Return radiance without noise.

        Parameters
        ----------
        radiance : ndarray of float32, shape (rows, columns, 3)
            The estimate's, or that of some of its samples.
        estimate : Estimate
        samples : int
            Of `radiance`.

        Returns
        -------
        ndarray of float32, shape (rows, columns, 3)
            Not cut at 1.
        """
        ...

    def deed(self, samples: int) -> str:
        """Say in a word or two what is done to a picture of so many samples."""
        ...


Cleaning = Callable[[SceneInputs, Raster], Cleaner]
"""Returns what cleans the estimates of a picture."""


class Denoiser:
    """Open Image Denoise alone, guided by the unlit colours, which have no noise."""

    doubling = 0.88
    """The mean of five volumes, 1 to 32 samples."""

    def clean(
        self, radiance: NDArray[np.float32], estimate: Estimate, samples: int
    ) -> NDArray[np.float32]:
        """See :meth:`Cleaner.clean`."""
        return denoise(radiance, estimate.albedo)

    def deed(self, samples: int) -> str:
        """See :meth:`Cleaner.deed`."""
        return "denoised"


def denoiser(inputs: SceneInputs, raster: Raster) -> Cleaner:
    """Return the denoiser, which cleans all pictures alike."""
    return Denoiser()


def cleaned(estimate: Estimate, cleaner: Cleaner) -> NDArray[np.float32]:
    """Return an estimate's picture without noise; its opacity is exact, and stays.

    Returns
    -------
    ndarray of float32, shape (rows, columns, 4)
        As renderers return it.
    """
    opacity = estimate.rgba[..., 3:]
    clean = cleaner.clean(estimate.radiance, estimate, estimate.samples)
    # Filters are wider than a pixel: nothing may shine where nothing is.
    return np.concatenate([np.where(opacity > 0, clean, 0).clip(0, 1), opacity], axis=2)


def error_of(estimate: Estimate, cleaner: Cleaner) -> float:
    """Estimate the error of :func:`cleaned`: the root mean square over all pixels and colours.

    A clean picture of n samples is measured against n other samples: their noise is independent
    of it, and on average adds its own variance to the square of the error. Of the picture of all
    2 n samples the error is smaller, by the factor :attr:`Cleaner.doubling`.

    Returns
    -------
    float
        Infinite after the first sample. Two pictures are cleaned for it.
    """
    if estimate.samples < 2:
        return math.inf
    first, second = estimate.halves
    more, fewer = (estimate.samples + 1) // 2, estimate.samples // 2
    squares = np.square(cleaner.clean(first, estimate, more) - second, dtype=np.float64)
    squares += np.square(cleaner.clean(second, estimate, fewer) - first, dtype=np.float64)
    squares -= np.square(first - second, dtype=np.float64)
    # Of each pixel, which are independent: chance may make their mean too small, even negative.
    pixels = squares.mean(axis=2) / 2
    chance = float(pixels.std()) / math.sqrt(pixels.size)
    return cleaner.doubling * math.sqrt(max(float(pixels.mean()), chance))
