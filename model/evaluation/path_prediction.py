"""Time and error of a path-traced picture at a setting, predicted from eight of its samples."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from model import metrics
from model.evaluation.prediction import Prediction
from model.generator.path_light_generator import MOST_SAMPLES
from model.rendering.path_tracing.cleaning import Cleaner, Denoiser, cleaned, error_of
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.raster import Raster
from model.rendering.resizing import enlarged
from model.rendering.setting import Setting, SettingRenderer
from model.scene.inputs import SceneInputs

DRAWN = MOST_SAMPLES
"""Samples of each pixel that are drawn: as many as a network finishes."""

SMOOTHED = 0.625**2
"""Variance of independent pixels after interpolation to twice as many along both sides."""


class PathPredictor:
    """Predicts path-traced pictures of one scene from the first samples of its pixels.

    Noise falls with the root of the number of samples; what a denoiser leaves, by a factor for
    each doubling.

    Parameters
    ----------
    renderer : SettingRenderer
        In path-traced light.
    inputs : SceneInputs
    shown : Raster
        Pixels of the whole picture.
    """

    def __init__(self, renderer: SettingRenderer, inputs: SceneInputs, shown: Raster) -> None:
        self._renderer, self._inputs, self._shown = renderer, inputs, shown
        self._parts: dict[Raster, _Begun] = {}
        self._whole = self._begun(Setting())

    def predict(self, setting: Setting) -> Prediction:
        """Predict the whole picture at a setting."""
        if setting == Setting.exact("path"):
            return Prediction(setting, self._whole.seconds(setting), 0.0)
        begun = self._begun(setting)
        error = begun.error(setting)
        if begun is not self._whole:
            share = 1.0 if setting.denoised else SMOOTHED
            error = math.hypot(math.sqrt(share) * error, self._interpolation(begun))
        return Prediction(setting, begun.seconds(setting), error)

    def _begun(self, setting: Setting) -> _Begun:
        raster = setting.raster(self._shown)
        if raster not in self._parts:
            self._parts[raster] = _begin(self._renderer, self._inputs, raster)
        return self._parts[raster]

    def _interpolation(self, few: _Begun) -> float:
        """Estimate the error that interpolated pixels have without any noise."""
        raster, shown = few.raster, self._shown
        whole, part = self._whole.estimate, few.estimate
        gap = metrics.rmse(enlarged(part.albedo, raster, shown), whole.albedo)
        # Shading has edges where unlit colours have them.
        bright = metrics.rmse(whole.rgba[..., :3], 0 * whole.albedo)
        unlit = metrics.rmse(whole.albedo, 0 * whole.albedo)
        return gap * bright / unlit if unlit else 0.0


@dataclass(frozen=True)
class _Cleaned:
    """Time that cleaning a picture of :data:`DRAWN` samples takes, and error that it leaves.

    Attributes
    ----------
    seconds : float
        Once.
    before : float
        Seconds of what guides it, drawn once a picture.
    error : float
    doubling : float
        Factor of the error for twice the samples.
    """

    seconds: float
    before: float
    error: float
    doubling: float


@dataclass(frozen=True)
class _Begun:
    """A picture after :data:`DRAWN` samples, with its times and its errors.

    Attributes
    ----------
    first, each : float
        Seconds of the first sample, with all that comes before it, and of each one after it.
    few, many : _Cleaned or None
        By what cleans pictures of up to :data:`MOST_SAMPLES` samples, and of more; None where
        nothing cleans.
    """

    raster: Raster
    estimate: Estimate
    first: float
    each: float
    few: _Cleaned | None = None
    many: _Cleaned | None = None

    def seconds(self, setting: Setting) -> float:
        """Seconds to draw the picture with so many samples."""
        traced = self.first + (setting.samples - 1) * self.each
        cleaned = self._cleaned(setting)
        if cleaned is None:
            return traced
        # Two tell the error, from the second sample on; one more is shown.
        times = 2 * (setting.samples > 1) + (self._left(setting) <= self._noise(setting))
        return traced + cleaned.before + times * cleaned.seconds

    def error(self, setting: Setting) -> float:
        """Error of its pixels with so many samples."""
        return min(self._noise(setting), self._left(setting))

    def _noise(self, setting: Setting) -> float:
        return self.estimate.error * math.sqrt(DRAWN / setting.samples)

    def _left(self, setting: Setting) -> float:
        """Error of the clean picture; infinite for one that is not cleaned."""
        cleaned = self._cleaned(setting)
        if cleaned is None:
            return math.inf
        return cleaned.error * cleaned.doubling ** math.log2(setting.samples / DRAWN)

    def _cleaned(self, setting: Setting) -> _Cleaned | None:
        if not setting.denoised:
            return None
        return self.few if setting.samples <= MOST_SAMPLES else self.many


def _begin(renderer: SettingRenderer, inputs: SceneInputs, raster: Raster) -> _Begun:
    tracer = renderer.tracer()
    try:
        # Not counted: threads, and tables of the TF.
        tracer.render(inputs, Raster(16, 16))
        begun, times = time.perf_counter(), []
        for last in tracer.refine(inputs, raster, DRAWN):
            times.append(time.perf_counter() - begun)
            estimate = last
    finally:
        tracer.close()
    counts = [2**n for n in range(len(times))]
    # The fastest counts: something else may have come between.
    each = min(np.diff(times) / np.diff(counts))
    if renderer.cleaning is None:
        return _Begun(raster, estimate, times[0], each)
    # Not counted: the filter, of which one of each size is kept.
    cleaned(estimate, Denoiser())
    few, many = (_clean(estimate, c) for c in (renderer.cleaning(inputs, raster), Denoiser()))
    return _Begun(raster, estimate, times[0], each, few, many)


def _clean(estimate: Estimate, cleaner: Cleaner) -> _Cleaned:
    begun = time.perf_counter()
    left = error_of(estimate, cleaner)
    told = time.perf_counter()
    cleaned(estimate, cleaner)
    seconds = time.perf_counter() - told
    # Two pictures were cleaned for the error.
    before = max(told - begun - 2 * seconds, 0.0)
    return _Cleaned(seconds, before, left, cleaner.doubling)
