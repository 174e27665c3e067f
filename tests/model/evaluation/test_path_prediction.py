"""Predicted errors of path-traced pictures, against pictures that were drawn whole."""

from __future__ import annotations

import math

import numpy as np
import pytest

from model import metrics
from model.evaluation.path_prediction import SMOOTHED, PathPredictor
from model.rendering.path_tracing import denoising
from model.rendering.path_tracing.cleaning import denoiser
from model.rendering.raster import Raster
from model.rendering.resizing import enlarged
from model.rendering.setting import Setting, SettingRenderer
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.volume import Volume

SHOWN = Raster(72, 56)

TRUE = Setting(samples=512)


def test_errors_are_those_of_whole_pictures(volume: Volume) -> None:
    scene = Scene.of(volume, 72, "path")
    cleaning = denoiser if denoising.available() else None
    renderer = SettingRenderer(volume, "path", scene.light, cleaning=cleaning)
    inputs = draw_sample(scene, 0, "holdout", 1)
    predictor = PathPredictor(renderer, inputs, SHOWN)
    truth = renderer.tracer(TRUE.samples, seed=3).render(inputs, SHOWN)[..., :3]
    settings = [Setting(samples=1), Setting(samples=16), Setting(samples=16, pixels=1 / 4)]
    if cleaning is not None:
        settings += [
            Setting(samples=4, denoised=True),
            Setting(samples=4, pixels=1 / 4, denoised=True),
        ]
    for setting in settings:
        expected = predictor.predict(setting)
        image, _seconds = renderer.draw(setting, inputs, SHOWN)
        error = metrics.rmse(image[..., :3], truth)
        # These blobs are smoother than scans: twice the samples help the denoiser more.
        most = 2.0 if setting.denoised else 1.3
        assert 1 / 1.3 < expected.rmse / error < most, setting
        assert expected.seconds > 0
    few, many = (predictor.predict(Setting(samples=n)) for n in (4, 400))
    assert few.rmse == pytest.approx(10 * many.rmse) and few.seconds < many.seconds
    assert predictor.predict(Setting.exact("path")).rmse == 0
    renderer.close()


def test_denoising_costs_time_and_is_left_where_noise_is_less(volume: Volume) -> None:
    if not denoising.available():
        pytest.skip("there is no denoiser for this machine")
    scene = Scene.of(volume, 48, "path")
    renderer = SettingRenderer(volume, "path", scene.light, cleaning=denoiser)
    predictor = PathPredictor(renderer, draw_sample(scene, 0, "holdout", 1), Raster(48, 48))
    for samples in (1, 64, 4096):
        plain, clean = (
            predictor.predict(Setting(samples=samples, denoised=each)) for each in (False, True)
        )
        assert clean.seconds > plain.seconds and clean.rmse <= plain.rmse
    renderer.close()


def test_interpolation_takes_away_so_much_of_the_noise() -> None:
    noise = np.random.default_rng(0).normal(size=(200, 200, 1)).astype(np.float32)
    smooth = enlarged(noise, Raster(200, 200), Raster(400, 400))
    assert float(smooth.std()) == pytest.approx(math.sqrt(SMOOTHED), rel=0.02)
