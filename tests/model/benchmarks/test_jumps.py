"""Jumps of pictures that are known to have some, or none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from ramp import make_tf

from model.benchmarks.jumps import LIMIT, edits, largest_jump
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.first_picture import first_picture
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.view import View
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

INPUTS = SceneInputs.of(View(), make_tf(130.0))
BIN = 100.0 / 255


class Drawn:
    """A picture whose brightness is a function of the mode's mean."""

    sample_distance = 0.5

    def __init__(self, brightness: Callable[[float], float]) -> None:
        self._brightness = brightness

    def render(
        self, inputs: SceneInputs, size: int, sample_distance: float | None = None
    ) -> NDArray[np.float32]:
        (mode,) = inputs.opacity_tf.modes
        return np.full((size, size, 4), self._brightness(mode.mean), np.float32)

    def close(self) -> None:
        pass


def test_the_mode_moves_by_one_bin() -> None:
    means = [each.opacity_tf.modes[0].mean for each in edits(INPUTS, 10)]
    np.testing.assert_allclose(means, 130 + BIN * np.linspace(0, 1, 11))


def test_an_even_change_has_no_jump() -> None:
    assert largest_jump(Drawn(lambda mean: 0.001 * mean), INPUTS, 4, 20).largest < 0.05


def test_a_jump_is_found_where_it_is() -> None:
    jump = largest_jump(Drawn(lambda mean: 0.1 * (mean > 130 + 0.52 * BIN)), INPUTS, 4, 20)
    assert jump.largest == pytest.approx(25.5, rel=1e-3)
    assert jump.at in (10, 11)


@pytest.mark.parametrize("lighting", ["none", "direct", "shadows", "soft"])
def test_the_ray_casters_pictures_change_evenly(lighting: Lighting) -> None:
    volume, tf = first_picture(read_volume(next(p for p in shipped_volumes() if "jet" in p.name)))
    light = None if lighting == "none" else LightDirection()
    renderer = RaycastRenderer(volume, lighting)
    inputs = SceneInputs.of(View(30, 20, 0, 0.7), tf, light=light)
    assert largest_jump(renderer, inputs, 40, 100).largest < LIMIT
    renderer.close()
