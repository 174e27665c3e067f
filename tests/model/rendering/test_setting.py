"""Settings of a picture, and how fewer pixels are shown in place of more."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from model.rendering.raster import Raster
from model.rendering.renderer import open_renderer
from model.rendering.resizing import enlarged
from model.rendering.setting import Setting, SettingRenderer
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.volume import Volume


@pytest.mark.parametrize("shape", [(7, 9), (20, 31), (5, 40)])
def test_pixels_between_are_interpolated_as_torch_does(shape: tuple[int, int]) -> None:
    image = np.random.default_rng(0).random((5, 9, 4)).astype(np.float32)
    planes = torch.from_numpy(image).permute(2, 0, 1)[None]
    theirs = torch.nn.functional.interpolate(planes, shape, mode="bilinear")
    np.testing.assert_allclose(
        enlarged(image, Raster(9, 5), Raster(shape[1], shape[0])),
        theirs[0].permute(1, 2, 0).numpy(),
        atol=1e-6,
    )


@pytest.mark.parametrize("pixels", [1.0, 1 / 2, 1 / 4, 1 / 16])
def test_parts_of_a_picture_are_those_of_the_whole(
    volume: Volume, scene: Scene, pixels: float
) -> None:
    inputs, shown = draw_sample(scene, 0, "holdout", 1), Raster(75, 64)
    renderer, setting = SettingRenderer(volume), Setting(pixels=pixels)
    whole, _seconds = renderer.draw(setting, inputs, shown)
    for part in shown.tiles(17, 9):
        drawn, _seconds = renderer.draw(setting, inputs, part)
        expected = whole[part.top : part.bottom, part.left : part.right]
        np.testing.assert_allclose(drawn, expected, atol=1e-5)
    renderer.close()


def test_a_setting_without_savings_is_the_renderers_own_picture(
    volume: Volume, scene: Scene
) -> None:
    inputs, shown = draw_sample(scene, 0, "holdout", 1), Raster(40, 24)
    settings = SettingRenderer(volume)
    own = open_renderer("raycast", volume, sample_distance=0.5)
    drawn, seconds = settings.draw(Setting(), inputs, shown)
    coarse, _seconds = settings.draw(Setting(pixels=0.25), inputs, shown)
    np.testing.assert_array_equal(drawn, own.render(inputs, shown))
    few = Raster(20, 16)
    np.testing.assert_array_equal(coarse, enlarged(own.render(inputs, few), few, shown))
    assert seconds > 0
    settings.close()
    own.close()


def test_others_draw_by_their_name_and_in_their_size(volume: Volume, scene: Scene) -> None:
    small = np.full((8, 8, 4), 0.25, np.float32)
    renderer = SettingRenderer(volume, others={"a network": lambda inputs, raster: small})
    inputs = draw_sample(scene, 0, "holdout", 1)
    image, seconds = renderer.draw(Setting(other="a network"), inputs, Raster(20, 12))
    assert image.shape == (12, 20, 4) and np.all(image == 0.25) and seconds >= 0
    assert Setting(other="a network").text("none") == "a network"
    renderer.close()
