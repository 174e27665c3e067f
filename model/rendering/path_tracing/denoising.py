"""Denoising of path-traced pictures by Intel's Open Image Denoise, and the error that remains.

There is no package for some machines, such as those with ARM processors. Without it,
:func:`available` returns False and pictures are shown as traced.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Callable
from functools import lru_cache
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

MOST_FILTERS = 4
"""Number of cached filters, each for one size: building one takes as long as denoising twice."""


class DenoisingError(TfscopeError):
    """A picture could not be denoised."""


@lru_cache(maxsize=1)
def installed() -> bool:
    """Whether the package is installed; quick, while :func:`available` imports torch."""
    return find_spec("pyoidn") is not None


@lru_cache(maxsize=1)
def _package() -> Any:
    """Return the denoiser's package; None if it is missing or its library cannot be used."""
    try:
        import pyoidn

        # The library is loaded at its first use.
        usable = pyoidn.Device.is_cpu_available()
    except (ImportError, OSError, AttributeError):
        return None
    return pyoidn if usable else None


def available() -> bool:
    """Whether pictures can be denoised on this machine."""
    return _package() is not None


def denoise(
    color: NDArray[np.float32], albedo: NDArray[np.float32], quick: bool = False
) -> NDArray[np.float32]:
    """Denoise radiance (rows, columns, 3), not cut at 1, guided by unlit colours in [0, 1].

    It may be called from any thread; calls wait for one another. A quick one takes half the time,
    and errs by up to 3 % more: for what is finished afterwards.
    """
    if not available():
        raise DenoisingError("There is no denoiser for this machine; choose pictures without one.")
    return _denoiser().run({"color": color, "albedo": albedo}, quick)


class _Denoiser:
    """The device, and the filters made last, each with the memory that it reads and writes."""

    def __init__(self, package: Any) -> None:
        self._package = package
        self._lock = threading.Lock()
        self._filters: OrderedDict[tuple[Any, ...], tuple[Any, dict[str, Any]]] = OrderedDict()
        self._device = package.Device()
        self._device.commit()
        self._check()

    def run(self, images: dict[str, NDArray[np.float32]], quick: bool) -> NDArray[np.float32]:
        """Denoise `images["color"]`, guided by the other; what is returned is the caller's own."""
        shape = images["color"].shape
        with self._lock:
            found = self._filters.pop((shape, quick), None)
            filter_, memory = found or self._made(shape, quick)
            for name, image in images.items():
                np.copyto(memory[name], image)
            filter_.execute()
            self._check()
            self._filters[shape, quick] = filter_, memory
            while len(self._filters) > MOST_FILTERS:
                self._filters.popitem(last=False)[1][0].release()
            return np.array(memory["output"])

    def _made(self, shape: tuple[int, ...], quick: bool) -> tuple[Any, dict[str, Any]]:
        """Make a filter for pictures of a size."""
        memory = {name: np.zeros(shape, np.float32) for name in ("color", "albedo", "output")}
        filter_ = self._package.Filter(self._device, "RT")
        for name, image in memory.items():
            filter_.set_image(name, image, self._package.OIDN_FORMAT_FLOAT3)
        filter_.set_bool("hdr", True)
        if quick:
            filter_.set_quality(self._package.OIDN_QUALITY_FAST)
        filter_.commit()
        return filter_, memory

    def _check(self) -> None:
        if message := self._device.get_error():
            raise DenoisingError(f"The denoiser failed: {message}. Choose pictures without it.")


@lru_cache(maxsize=1)
def _denoiser() -> _Denoiser:
    return _Denoiser(_package())


class Cleaner(Protocol):
    """Removes the noise from the estimates of one picture."""

    doubling: float  # factor of a clean picture's error for twice the samples, on average

    def clean(
        self, radiance: NDArray[np.float32], estimate: Estimate, samples: int
    ) -> NDArray[np.float32]:
        """Return radiance without noise: the estimate's, or that of some of its samples."""

    def method(self, samples: int) -> str:
        """Return how noise is removed from a picture of this many samples, in words."""


Cleaning = Callable[[SceneInputs, Raster], Cleaner]
"""Returns the cleaner of a picture's estimates."""


class Denoiser:
    """Open Image Denoise alone, guided by the unlit colours, which have no noise."""

    doubling = 0.88  # the mean of five volumes, 1 to 32 samples

    def clean(
        self, radiance: NDArray[np.float32], estimate: Estimate, samples: int
    ) -> NDArray[np.float32]:
        """See :meth:`Cleaner.clean`; one sample is denoised quickly, as more follow."""
        return denoise(radiance, estimate.albedo, quick=samples == 1)

    def method(self, samples: int) -> str:
        """See :meth:`Cleaner.method`."""
        return "denoised"


def denoiser(inputs: SceneInputs, raster: Raster) -> Cleaner:
    """Return the denoiser, which cleans all pictures alike."""
    return Denoiser()


def squared_error_of(
    clean: NDArray[np.float32], before: Estimate, estimate: Estimate
) -> tuple[float, float] | None:
    """Estimate the squared error of a cleaned picture from the samples drawn after it.

    These form two halves, whose noise is independent of the picture's and of each other's. The
    expected product of the picture's differences from both is its squared error. Returns its mean
    over pixels and colours, which may be negative, and the standard error; None without at least
    one new sample in each half.
    """
    more = (estimate.counts - before.counts)[:, None, None, None]
    if not more.all():
        return None
    sums = estimate.halves * estimate.counts[:, None, None, None]
    first, second = (sums - before.halves * before.counts[:, None, None, None]) / more
    # Per pixel, as pixels are independent.
    pixels = ((clean - first) * (clean - second)).mean(axis=2, dtype=np.float64)
    return float(pixels.mean()), float(pixels.std()) / math.sqrt(pixels.size)
