"""Speed against accuracy: time and error of settings on the same scenes, and which are worth it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean, median

import numpy as np
from numpy.typing import NDArray

from model import metrics
from model.rendering.path_tracing.cleaning import Cleaning
from model.rendering.raster import Raster
from model.rendering.setting import Others, Setting, SettingRenderer
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.volume import Volume

DISTANCES = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Sample distances of settings, in voxels."""

PIXELS = (1.0, 1 / 2, 1 / 4, 1 / 16)
"""Pixels drawn for each pixel shown."""

SAMPLES = (1, 4, 16, 64, 256)
"""Samples of each pixel in path-traced light."""

REPEATS = 3
"""Drawings of each picture; the median of their times counts."""


@dataclass(frozen=True)
class Measured:
    """What a setting costs and how wrong it is, averaged over scenes.

    Attributes
    ----------
    seconds : float
        To draw a picture.
    rmse, flip : float
        Distance from the exact picture, see :mod:`model.metrics`.
    worst : float
        RMSE of the worst scene.
    largest : float
        Error of the worst pixel's worst channel over all scenes, 0 to 1.
    """

    setting: Setting
    seconds: float
    rmse: float
    flip: float
    worst: float
    largest: float


@dataclass(frozen=True)
class Tradeoff:
    """All settings of one volume under one lighting.

    Attributes
    ----------
    exact : Setting
        Of the picture that errors are measured against.
    exact_seconds : float
        To draw that.
    points : tuple of Measured
        By time, the fastest first.
    front : frozenset of Setting
        Those that no other one, nor the exact picture, beats in time and RMSE together.
    """

    volume: str
    dimensions: tuple[int, int, int]
    lighting: Lighting
    size: int
    count: int
    exact: Setting
    exact_seconds: float
    points: tuple[Measured, ...]
    front: frozenset[Setting]


def settings_of(lighting: Lighting, vtk: bool = True, denoises: bool = False) -> list[Setting]:
    """Return the settings that are measured under a lighting, all but the exact one.

    Parameters
    ----------
    vtk : bool
        Whether VTK's are among them, where it draws that light.
    denoises : bool
        Whether denoised pictures are among them, in path-traced light.
    """
    if lighting == "path":
        return [
            Setting(samples=count, pixels=each, denoised=denoised)
            for denoised in (False, True)[: 1 + denoises]
            for count in SAMPLES
            for each in (1.0, 1 / 4)
        ]
    found = [Setting("raycast", d, each) for d in DISTANCES for each in PIXELS]
    if vtk and lighting != "soft":
        found += [Setting("vtk", d) for d in DISTANCES if d >= 0.5]
    return [setting for setting in found if setting != Setting.exact(lighting)]


def measure_tradeoff(
    volume: Volume,
    lighting: Lighting,
    light: LightDirection | None,
    scenes: Sequence[SceneInputs],
    size: int,
    settings: Iterable[Setting] | None = None,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
    threads: int | None = None,
    cleaning: Cleaning | None = None,
    others: Others | None = None,
) -> Tradeoff:
    """Draw scenes at each setting, and measure time and distance from the exact picture.

    Parameters
    ----------
    scenes : sequence of SceneInputs
    size : int
        Width and height of pictures in pixels.
    settings : iterable of Setting, optional
        By default :func:`settings_of` the lighting.
    on_progress : callable
        Called with the numbers of settings done and in total.
    threads, cleaning, others
        See :class:`model.rendering.setting.SettingRenderer`.
    """
    chosen = list(settings_of(lighting) if settings is None else settings)
    chosen += [Setting(other=name) for name in others or {}]
    exact, shown = Setting.exact(lighting), Raster(size, size)
    renderer = SettingRenderer(volume, lighting, light, threads, cleaning, others)
    try:
        # The first picture includes the compilation of kernels.
        renderer.draw(Setting(), scenes[0], Raster(16, 16))
        drawn = [renderer.draw(exact, inputs, shown) for inputs in scenes]
        truths = [rgba[..., :3] for rgba, _seconds in drawn]
        points = []
        for number, setting in enumerate(chosen):
            points.append(_measure(renderer, setting, scenes, truths, shown))
            on_progress(number + 1, len(chosen))
    finally:
        renderer.close()
    points.sort(key=lambda point: point.seconds)
    exact_seconds = fmean(seconds for _rgba, seconds in drawn)
    return Tradeoff(
        volume.name,
        volume.dimensions,
        lighting,
        size,
        len(scenes),
        exact,
        exact_seconds,
        tuple(points),
        frozenset(
            point.setting
            for point in pareto_front(points)
            if point.seconds < exact_seconds or point.setting == exact
        ),
    )


def pareto_front(points: Iterable[Measured]) -> list[Measured]:
    """Return the points that no other one beats in time and RMSE together, the fastest first."""
    front: list[Measured] = []
    for point in sorted(points, key=lambda each: (each.seconds, each.rmse)):
        if not front or point.rmse < front[-1].rmse:
            front.append(point)
    return front


def _measure(
    renderer: SettingRenderer,
    setting: Setting,
    scenes: Sequence[SceneInputs],
    truths: Sequence[NDArray[np.float32]],
    shown: Raster,
) -> Measured:
    seconds, errors, flips, largest = [], [], [], 0.0
    # Not counted: windows, shaders and paths of a renderer that draws for the first time.
    renderer.draw(setting, scenes[0], Raster(16, 16))
    for inputs, truth in zip(scenes, truths, strict=True):
        rgba, first = renderer.draw(setting, inputs, shown)
        # What takes seconds varies little.
        repeats = REPEATS - 1 if first < 1 else 0
        times = [first, *(renderer.draw(setting, inputs, shown)[1] for _ in range(repeats))]
        seconds.append(median(times))
        image = rgba[..., :3]
        errors.append(metrics.rmse(image, truth))
        flips.append(metrics.flip(image, truth))
        largest = max(largest, float(np.abs(image - truth).max()))
    return Measured(setting, fmean(seconds), fmean(errors), fmean(flips), max(errors), largest)
