"""Path-traced pictures as shown and saved: cleaned as long as that reduces their error."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.rendering.path_tracing.denoising import Cleaner, Cleaning, squared_error_of
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.path_tracing.moving_light import APART, LightHistory, coarse, light_of, relit
from model.rendering.path_tracing.renderer import SAMPLES, PathTracer
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs

MOST_SAMPLES = 1 << 14  # of each pixel of a picture that is refined to a given error
TINY = 1e-40  # replaces a variance of 0


@dataclass(frozen=True, eq=False)
class Refined:
    """A picture after some samples per pixel, cleaned or not."""

    rgba: NDArray[np.float32]  # as renderers return it, shape (rows, columns, 4)
    samples: int  # of each pixel
    error: float  # estimated RMS error of the colours; infinite after the first sample
    method: str  # how noise was removed, such as "denoised"; empty where it was not


class _Picture:
    """A picture whose estimates are shown one after the other."""

    def __init__(self, inputs: SceneInputs, raster: Raster, cleaning: Cleaning | None) -> None:
        self._inputs, self._raster, self._cleaning = inputs, raster, cleaning
        self._cleaner: Cleaner | None = None
        self._part = raster
        self._before: tuple[Estimate, NDArray[np.float32]] | None = None
        # Squared errors with their standard errors, each as if it were of the present picture.
        self._found: list[tuple[float, float]] = []
        self._least = math.inf

    def shown(self, estimate: Estimate) -> Refined:
        """Return an estimate as it is shown."""
        if self._cleaning is None:
            return Refined(estimate.rgba, estimate.samples, estimate.error, "")
        if self._cleaner is None:
            self._part = estimate.traced_part(self._raster)
            self._cleaner = self._cleaning(self._inputs, self._part)
        top, left = self._part.top - self._raster.top, self._part.left - self._raster.left
        place = slice(top, top + self._part.rows), slice(left, left + self._part.columns)
        part = estimate.cut(*place)
        error = self._error(part, self._cleaner)
        # Without an estimate, noise is assumed to dominate.
        if math.isfinite(error) and estimate.error < error:
            self._cleaning = None
            return self.shown(estimate)
        clean = self._cleaner.clean(part.radiance, part, part.samples)
        self._before = part, clean
        picture = estimate.rgba.copy()
        picture[..., :3] = 0
        # Filters are wider than a pixel: empty pixels must stay empty.
        picture[place][..., :3] = np.where(part.rgba[..., 3:] > 0, clean, 0).clip(0, 1)
        return Refined(picture, estimate.samples, error, self._cleaner.method(estimate.samples))

    def _error(self, part: Estimate, cleaner: Cleaner) -> float:
        """Estimate the error of a clean picture from those of all pictures before.

        One alone is uncertain by up to its own size after a few samples. Together, weighted by how
        certain they are, they are less so. More samples never make a picture worse.
        """
        if self._before is None:
            return math.inf
        before, clean = self._before
        if cleaner.method(part.samples) != cleaner.method(before.samples):
            clean = cleaner.clean(before.radiance, part, before.samples)
            self._found.clear()
            self._least = math.inf
        found = squared_error_of(clean, before, part)
        if found is None:
            return math.inf
        decay = cleaner.doubling ** (2 * math.log2(part.samples / before.samples))
        self._found = [(decay * mean, decay * spread) for mean, spread in (*self._found, found)]
        weights = [1 / max(spread**2, TINY) for _mean, spread in self._found]
        mean = math.fsum(w * m for w, (m, _) in zip(weights, self._found, strict=True))
        square = max(mean / sum(weights), sum(weights) ** -0.5)
        pixels = self._part.rows * self._part.columns / (self._raster.rows * self._raster.columns)
        self._least = min(self._least, math.sqrt(pixels * square))
        return self._least


class RefiningRenderer:
    """A path tracer as a renderer, with pictures cleaned as long as that reduces their error."""

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
        self,
        inputs: SceneInputs,
        size: int | Raster,
        sample_distance: float | None = None,
        *,
        go_on: Callable[[], object] | None = None,
    ) -> NDArray[np.float32]:
        """Render one image; see :class:`model.rendering.renderer.Renderer`."""
        found = self.drawn(inputs, size, self.samples, sample_distance=sample_distance)
        assert found is not None
        return found.rgba

    def drawn(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        samples: int,
        wanted: Callable[[], bool] = lambda: True,
        sample_distance: float | None = None,
    ) -> Refined | None:
        """Draw a whole picture of so many samples; None if it is no longer wanted meanwhile."""
        # The samples after the last but one give the error, so only these two are cleaned.
        last: deque[Estimate] = deque(maxlen=2)
        scene = inputs, size, samples, wanted, sample_distance
        for estimate in self._tracer.refine_in_turns(*scene):
            if estimate is None:
                return None
            last.append(estimate)
        picture = _Picture(inputs, Raster.of(size), self._cleaning)
        *_, found = map(picture.shown, last)
        return found

    def moving(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        wanted: Callable[[], bool] = lambda: True,
        sample_distance: float | None = None,
    ) -> Refined | None:
        """Draw a picture while something moves; None if it is no longer wanted meanwhile.

        Where pictures are cleaned, light comes from fewer pixels and from the pictures before;
        see :mod:`.moving_light`. Else it is one of one sample.
        """
        raster = Raster.of(size)
        if self._cleaning is None:
            return self.drawn(inputs, raster, 1, wanted, sample_distance)
        few, apart = coarse(raster), APART * (sample_distance or self.sample_distance)
        depth = np.empty(few.shape, dtype=np.float32)
        scene = inputs, few, 1, wanted, apart, depth
        last = next(self._tracer.refine_in_turns(*scene, at_rest=False))
        if last is None:
            return None
        unlit = self._tracer.unlit(inputs, raster, wanted, sample_distance)
        if unlit is None:
            return None
        cleaner = self._cleaning(inputs, few)
        lit = cleaner.clean(last.radiance, last, last.samples)
        light = self._history.averaged(inputs, few, light_of(lit, last.albedo), depth)
        picture = relit(unlit, light, last.albedo)
        return Refined(picture, last.samples, math.inf, cleaner.method(last.samples))

    def refined(
        self,
        inputs: SceneInputs,
        size: int | Raster,
        samples: int,
        wanted: Callable[[], bool] = lambda: True,
        sample_distance: float | None = None,
        error: float = 0.0,
    ) -> Iterator[Refined | None]:
        """Draw a picture with ever more samples, and yield it after 1, 2, 4, 8 ... and the last.

        No more are drawn from an estimated error on, unless it is 0. None is yielded whenever the
        picture is not wanted for now; whoever asks for more goes on.
        """
        picture = _Picture(inputs, Raster.of(size), self._cleaning)
        scene = inputs, size, samples, wanted, sample_distance
        for estimate in self._tracer.refine_in_turns(*scene):
            found = None if estimate is None else picture.shown(estimate)
            yield found
            if found is not None and 0 < error >= found.error:
                return

    def close(self) -> None:
        """End the threads; the renderer cannot be used afterwards."""
        self._tracer.close()
