"""Path-traced pictures over the number of samples: time, error, and the error that is told."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.generator.path_light_generator import cleaning_of
from model.rendering.path_tracing.cleaning import Denoiser, cleaned
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.path_tracing.refinement import drawn, shown
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import Lighting
from model.scene.volume import Volume

RAYCAST_LIGHTS: tuple[Lighting, ...] = ("none", "direct", "shadows", "soft")

FACTOR = 1.5
"""Within which of the true error the error that is told should lie."""


@dataclass(frozen=True)
class PathRow:
    """A picture of a scene after some samples.

    Attributes
    ----------
    scene : int
        Its number.
    samples : int
    seconds : float
        From the beginning until it could be shown, cleaned where that helps.
    traced, denoised, shown : float
        RMSE of the colours against many samples, as it was traced, denoised by the library alone,
        and as it is shown; less what the many samples' own noise adds.
    told : float or None
        The error that is told of what is shown; None after the first sample.
    """

    scene: int
    samples: int
    seconds: float
    traced: float
    denoised: float
    shown: float
    told: float | None

    @property
    def is_told_well(self) -> bool:
        """Whether the error that is told is within a factor of 1.5 of the true one."""
        if self.told is None:
            return False
        return self.shown / FACTOR <= self.told <= self.shown * FACTOR


@dataclass(frozen=True)
class OtherLightRow:
    """A picture of a scene in a light that the ray caster draws, as if it were path-traced.

    Attributes
    ----------
    seconds : float
    error : float
        RMSE of the colours against path-traced light; less what its noise adds.
    brightened : float
        The same, all colours times the factor for which it is least.
    """

    scene: int
    lighting: Lighting
    seconds: float
    error: float
    brightened: float


def other_light_rows(
    volume: Volume, scenes: Sequence[SceneInputs], size: int, exact: Sequence[Estimate]
) -> Iterator[OtherLightRow]:
    """Draw each scene in the ray caster's lights; see :func:`path_rows`."""
    for lighting in RAYCAST_LIGHTS:
        renderer = RaycastRenderer(volume, lighting)
        renderer.render(scenes[0], size)
        for number, inputs in enumerate(scenes):
            begun = time.perf_counter()
            rgba = renderer.render(inputs, size)
            seconds = time.perf_counter() - begun
            own, true = (each[..., :3].astype(np.float64) for each in (rgba, exact[number].rgba))
            factor = (own * true).sum() / max((own**2).sum(), 1e-12)
            bright = (factor * rgba).astype(np.float32)
            errors = (_rmse(image, exact[number]) for image in (rgba, bright))
            yield OtherLightRow(number, lighting, seconds, *errors)
        renderer.close()


def exact_pictures(
    volume: Volume, scenes: Sequence[SceneInputs], size: int, truth: int
) -> list[Estimate]:
    """Draw each scene with many samples to compare with, whose random numbers are others."""
    tracer = PathTracer(volume, seed=1)
    found = [deque(tracer.refine(inputs, size, truth), maxlen=1)[0] for inputs in scenes]
    tracer.close()
    return found


def path_rows(
    volume: Volume,
    scenes: Sequence[SceneInputs],
    size: int,
    samples: int,
    exact: Sequence[Estimate],
) -> Iterator[PathRow]:
    """Draw each scene with ever more samples.

    Parameters
    ----------
    size : int
        Width and height of the pictures in pixels.
    samples : int
        Most of a picture that is measured.
    exact : sequence of Estimate
        To compare with, see :func:`exact_pictures`.
    """
    tracer = PathTracer(volume)
    cleaning, release = cleaning_of(volume)
    # The first picture takes compilation and preparation.
    drawn(tracer, scenes[0], size, 2, cleaning=cleaning)
    for number, inputs in enumerate(scenes):
        found = []
        begun = time.perf_counter()
        cleaner = cleaning(inputs, Raster.of(size)) if cleaning else None
        for estimate in tracer.refine(inputs, size, samples):
            picture = shown(estimate, cleaner)
            found.append((estimate, picture, time.perf_counter() - begun))
        for estimate, picture, seconds in found:
            told = None if math.isinf(picture.error) else picture.error
            alone = cleaned(estimate, Denoiser()) if cleaning else estimate.rgba
            images = estimate.rgba, alone, picture.rgba
            traced, denoised, clean = (_rmse(image, exact[number]) for image in images)
            yield PathRow(number, estimate.samples, seconds, traced, denoised, clean, told)
    tracer.close()
    release()


def _rmse(rgba: NDArray[np.float32], exact: Estimate) -> float:
    square = np.mean((rgba - exact.rgba)[..., :3].astype(np.float64) ** 2)
    return math.sqrt(max(float(square) - exact.error**2, 0.0))
