"""Predicted times and errors, against pictures that were drawn whole."""

from __future__ import annotations

import numpy as np
import pytest

from model import metrics
from model.errors import RenderError
from model.evaluation.prediction import (
    TILE,
    TILES,
    Prediction,
    Predictor,
    chosen,
    chosen_tiles,
)
from model.rendering.raster import Raster
from model.rendering.setting import Setting, SettingRenderer
from model.samples.sampling import draw_sample
from model.scene.scene import Lighting, Scene
from model.scene.volume import Volume


@pytest.mark.parametrize("lighting", ["none", "direct"])
def test_errors_of_tiles_are_those_of_the_whole_picture(volume: Volume, lighting: Lighting) -> None:
    scene, shown = Scene.of(volume, 200, lighting), Raster(200, 140)
    renderer = SettingRenderer(volume, lighting, scene.light)
    for number in range(3):
        inputs = draw_sample(scene, 0, "holdout", number)
        predictor = Predictor(renderer, lighting, inputs, shown)
        truth, _seconds = renderer.draw(Setting.exact(lighting), inputs, shown)
        for setting in (Setting(), Setting(sample_distance=2.0), Setting(pixels=1 / 4)):
            expected = predictor.predict(setting)
            image, _seconds = renderer.draw(setting, inputs, shown)
            error = metrics.rmse(image[..., :3], truth[..., :3])
            assert expected.rmse == pytest.approx(error, rel=0.6)
            assert expected.seconds > 0
        assert predictor.predict(Setting.exact(lighting)).rmse == 0
    renderer.close()


def test_tiles_give_a_mean_without_bias_however_they_are_chosen() -> None:
    shown = Raster(TILE * 40, TILE * 30)
    cells = list(shown.tiles(TILE, TILE))
    numbers = np.random.default_rng(0).random(len(cells)) ** 6
    for interest in (numbers, np.ones(len(cells)), np.zeros(len(cells)), numbers**0.5 + 0.1):
        tiles, weights = chosen_tiles(cells, interest)
        assert len(tiles) <= TILES
        mean = sum(
            weight * numbers[cells.index(tile)] for tile, weight in zip(tiles, weights, strict=True)
        )
        assert mean == pytest.approx(numbers.mean(), rel=0.35)
    tiles, weights = chosen_tiles(cells, numbers)
    mean = sum(w * numbers[cells.index(tile)] for tile, w in zip(tiles, weights, strict=True))
    # Where they lie by what is asked of them, they know it.
    assert mean == pytest.approx(numbers.mean(), rel=0.1)


def test_a_small_picture_is_its_tiles() -> None:
    cells = list(Raster(20, 13).tiles(TILE, TILE))
    tiles, weights = chosen_tiles(cells, np.zeros(len(cells)))
    assert tiles == cells
    assert weights.sum() == pytest.approx(1.0)
    assert weights[-1] == pytest.approx(4 * 5 / (20 * 13))


FAST, MIDDLE, EXACT = (
    Prediction(Setting(sample_distance=distance), seconds, error)
    for distance, seconds, error in ((4.0, 0.001, 0.05), (1.0, 0.01, 0.01), (0.1, 0.5, 0.0))
)


def test_the_nearest_in_time_or_the_fastest_that_is_near_is_chosen() -> None:
    all_three = [EXACT, FAST, MIDDLE]
    assert chosen(all_three, 0.02, None) == MIDDLE
    assert chosen(all_three, None, 0.02) == MIDDLE
    assert chosen(all_three, None, 0.06) == FAST
    assert chosen(all_three, 1.0, 0.06) == EXACT
    assert chosen(all_three, None, 0.0) == EXACT


@pytest.mark.parametrize(
    ("seconds", "error", "said"),
    [
        (0.0005, None, "0.5 ms is too little .* about 1 ms, with an error of 0.05"),
        (0.02, 0.001, "An error of 0.001 takes about 500 ms"),
        (None, -1.0, "No setting comes to an error of -1 here; .* 0, in 500 ms"),
    ],
)
def test_what_cannot_be_kept_says_what_can(
    seconds: float | None, error: float | None, said: str
) -> None:
    with pytest.raises(RenderError, match=said):
        chosen([FAST, MIDDLE, EXACT], seconds, error)
