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
        """See :meth:`Cleaner.clean`; one sample is denoised quickly, as more follow."""
        return denoise(radiance, estimate.albedo, quick=samples == 1)

    def deed(self, samples: int) -> str:
        """See :meth:`Cleaner.deed`."""
        return "denoised"


def denoiser(inputs: SceneInputs, raster: Raster) -> Cleaner:
    """Return the denoiser, which cleans all pictures alike."""
    return Denoiser()


def squared_error_of(
    clean: NDArray[np.float32], before: Estimate, estimate: Estimate
) -> tuple[float, float] | None:
    """Estimate the squared error of a clean picture by the samples that were drawn since then.

    These are in two halves whose noise is independent of the picture and of each other: the product
    of its differences to both is the square of its error on average.

    Parameters
    ----------
    clean : ndarray of float32, shape (rows, columns, 3)
        Radiance without noise.
    before, estimate : Estimate
        What it was made of, and that with more samples.

    Returns
    -------
    tuple of float, or None
        Mean square over all pixels and colours, which may be negative, and its standard error;
        None where there is but one more sample.
    """
    more = (estimate.counts - before.counts)[:, None, None, None]
    if not more.all():
        return None
    sums = estimate.halves * estimate.counts[:, None, None, None]
    first, second = (sums - before.halves * before.counts[:, None, None, None]) / more
    # Of each pixel, which are independent.
    pixels = ((clean - first) * (clean - second)).mean(axis=2, dtype=np.float64)
    return float(pixels.mean()), float(pixels.std()) / math.sqrt(pixels.size)
