"""Path-traced pictures as they are shown and saved: cleaned while that brings them nearer."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.rendering.path_tracing.cleaning import Cleaner, Cleaning, cleaned, error_of
from model.rendering.path_tracing.coarse_light import APART, coarse, light_of, relit
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.path_tracing.light_history import LightHistory
from model.rendering.path_tracing.renderer import SAMPLES, PathTracer
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

MOST_SAMPLES = 1 << 14
"""Of each pixel of a picture that goes on until it is good enough."""


@dataclass(frozen=True, eq=False)
class Refined:
    """A picture as far as it is drawn.

    Attributes
    ----------
    rgba : ndarray of float32, shape (rows, columns, 4)
        As renderers return it.
    samples : int
        Of each pixel.
    error : float
        Estimated error of the colours, root mean square over all pixels; infinite after the first
        sample.
    deed : str
        What was done to take the noise out, such as "denoised"; empty where nothing was.
    """

    rgba: NDArray[np.float32]
    samples: int
    error: float
    deed: str


def shown(estimate: Estimate, cleaner: Cleaner | None) -> Refined:
    """Return an estimate as it is shown.

    Parameters
    ----------
    cleaner : Cleaner, optional
        It cleans the picture as long as the estimated error is smaller then: a picture of many
        samples is shown as it was traced.
    """
    if cleaner is not None:
        left = error_of(estimate, cleaner)
        # After the first sample neither is known, and noise is the larger by far.
        if not estimate.error < left:
            return Refined(
                cleaned(estimate, cleaner), estimate.samples, left, cleaner.deed(estimate.samples)
            )
    return Refined(estimate.rgba, estimate.samples, estimate.error, "")


def refined(
    tracer: PathTracer,
    inputs: SceneInputs,
    size: int | Raster,
    samples: int,
    wanted: Callable[[], bool] = lambda: True,
    sample_distance: float | None = None,
    *,
    cleaning: Cleaning | None,
    error: float = 0.0,
) -> Iterator[Refined]:
    """Draw a picture with ever more samples, and yield it after 1, 2, 4, 8 ... and the last.

    Parameters
    ----------
    tracer, inputs, size, samples, wanted, sample_distance
        See :meth:`model.rendering.path_tracing.renderer.PathTracer.refine`.
    cleaning : callable, optional
        Gives what cleans the picture; see :func:`shown`.
    error : float
        Estimated error from which no more samples are drawn; 0 for as many as were asked for.
    """
    cleaner = cleaning(inputs, Raster.of(size)) if cleaning else None
    for estimate in tracer.refine(inputs, size, samples, wanted, sample_distance):
        found = shown(estimate, cleaner)
        yield found
        if error > 0 and found.error <= error:
            return


def drawn(
    tracer: PathTracer,
    inputs: SceneInputs,
    size: int | Raster,
    samples: int,
    sample_distance: float | None = None,
    *,
    cleaning: Cleaning | None,
    error: float = 0.0,
    seconds: float | None = None,
) -> Refined:
    """Draw a whole picture; see :func:`refined`.

    Unless an error is aimed at, or a time is kept, none but the last is cleaned.

    Parameters
    ----------
    seconds : float, optional
        That it may take: as many samples as there is time for, one at least.
    """
    if error > 0 or seconds is not None:
        begun = time.perf_counter()
        coming = refined(
            tracer,
            inputs,
            size,
            samples,
            sample_distance=sample_distance,
            cleaning=cleaning,
            error=error,
        )
        found = next(coming)
        # The next one has twice the samples.
        while seconds is None or 2 * (time.perf_counter() - begun) <= seconds:
            following = next(coming, None)
            if following is None:
                break
            found = following
        return found
    *_, estimate = tracer.refine(inputs, size, samples, sample_distance=sample_distance)
    return shown(estimate, cleaning(inputs, Raster.of(size)) if cleaning else None)


class RefiningRenderer:
    """A path tracer as a renderer whose pictures are as they are shown; see :func:`drawn`.

    Parameters
    ----------
    tracer : PathTracer
        It is closed with this.
    cleaning : callable, optional
        See :func:`refined`.
    samples : int
        Of each pixel in :meth:`render`.
    """

    def __init__(
        self, tracer: PathTracer, cleaning: Cleaning | None, samples: int = SAMPLES
    ) -> None:
        self.sample_distance = tracer.sample_distance
        self.samples = samples
        self._tracer, self._cleaning = tracer, cleaning
        self._history = LightHistory(tracer.volume)

    @property
    def cleans(self) -> bool:
        """Whether pictures of few samples are cleaned."""
        return self._cleaning is not None

    def render(
        self, inputs: SceneInputs, size: int | Raster, sample_distance: float | None = None
    ) -> NDArray[np.float32]:
        """Render one image; see :class:`model.rendering.renderer.Renderer`."""
        return drawn(
            self._tracer, inputs, size, self.samples, sample_distance, cleaning=self._cleaning
        ).rgba

    def drawn(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        samples: int,
        wanted: Callable[[], bool] = lambda: True,
        sample_distance: float | None = None,
    ) -> Refined | None:
        """Draw a whole picture of so many samples; None if it is no longer wanted meanwhile."""
        coming = self._tracer.refine(inputs, size, samples, wanted, sample_distance)
        (last,) = deque(coming, maxlen=1) or (None,)
        if last is None or last.samples < samples:
            return None
        return shown(last, self._cleaning(inputs, Raster.of(size)) if self._cleaning else None)

    def moving(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        wanted: Callable[[], bool] = lambda: True,
        sample_distance: float | None = None,
    ) -> Refined | None:
        """Draw a picture while something moves; None if it is no longer wanted meanwhile.

        Where pictures are cleaned, light comes from fewer pixels and from the pictures before;
        see :mod:`.coarse_light` and :mod:`.light_history`. Else it is one of one sample.

        Parameters
        ----------
        size : int or Raster
            A whole picture.
        """
        raster = Raster.of(size)
        if self._cleaning is None:
            return self.drawn(inputs, raster, 1, wanted, sample_distance)
        few, apart = coarse(raster), APART * (sample_distance or self.sample_distance)
        depth = np.empty(few.shape, dtype=np.float32)
        coming = self._tracer.refine(inputs, few, 1, wanted, apart, depth)
        last = next(coming, None)
        if last is None:
            return None
        unlit = self._tracer.unlit(inputs, raster, wanted, sample_distance)
        if unlit is None:
            return None
        cleaner = self._cleaning(inputs, few)
        lit = cleaner.clean(last.radiance, last, last.samples)
        light = self._history.averaged(inputs, few, light_of(lit, last.albedo), depth)
        picture = relit(unlit, light, last.albedo)
        return Refined(picture, last.samples, math.inf, cleaner.deed(last.samples))

    def refined(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        samples: int,
        wanted: Callable[[], bool] = lambda: True,
        sample_distance: float | None = None,
        error: float = 0.0,
    ) -> Iterator[Refined]:
        """Draw a picture with ever more samples; see :func:`refined`."""
        return refined(
            self._tracer,
            inputs,
            size,
            samples,
            wanted,
            sample_distance,
            cleaning=self._cleaning,
            error=error,
        )

    def close(self) -> None:
        """End the threads; the renderer cannot be used afterwards."""
        self._tracer.close()
