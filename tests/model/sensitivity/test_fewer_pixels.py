"""Sensitivities of fewer pixels: how many there are, and how near."""

from __future__ import annotations

import time
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.region import Region
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.sensitivity.cosine import cosine
from model.sensitivity.fewer_pixels import LEAST_SIZE, approximated
from model.sensitivity.rendered import region_responses


def itself(answer: NDArray[np.floating]) -> NDArray[np.floating]:
    return answer


def waves(size: int, seconds: float = 0.0) -> NDArray[np.float64]:
    """A field that many pixels show as it is: a wave over a slope."""
    time.sleep(seconds)
    place = (np.arange(size) + 0.5) / size
    field = 1 + np.sin(60 * place)[:, None] * place
    return np.repeat(field[..., None], 3, axis=2)


def test_without_a_limit_all_pixels_are_asked_for() -> None:
    found = approximated(waves, itself, 256, None, None)
    assert (found.size, found.cosine) == (256, 1.0)
    np.testing.assert_array_equal(found.answer, waves(256))


def test_the_nearer_it_is_to_be_the_more_pixels_it_has() -> None:
    sizes = [approximated(waves, itself, 512, None, error).size for error in (0.1, 1e-3, 1e-9)]
    assert sizes[0] < sizes[1] < sizes[2] == 512
    near = approximated(waves, itself, 512, None, 1e-3)
    assert near.cosine is not None
    assert 1 - near.cosine <= 1e-3


def test_it_ends_before_its_time_is_up() -> None:
    found = approximated(partial(waves, seconds=0.02), itself, 512, 0.05, None)
    assert found.size == LEAST_SIZE
    assert found.cosine is None
    assert approximated(waves, itself, 512, 60.0, None).size == 512


def test_few_pixels_are_asked_for_at_once() -> None:
    asked: list[int] = []

    def ask(size: int) -> NDArray[np.float64]:
        asked.append(size)
        return waves(size)

    assert approximated(ask, itself, 40, 1e-9, None).cosine == 1.0
    assert asked[-1] == 40
    assert len(asked) == 2


@pytest.mark.parametrize("error", [1e-2, 1e-4])
def test_the_curve_of_an_image_is_as_near_as_it_is_said_to_be(
    volume: Volume, scene: Scene, error: float
) -> None:
    renderer = RaycastRenderer(volume)
    inputs = draw_sample(scene, 0, "holdout", 1)

    def ask(size: int) -> NDArray[np.float32]:
        return region_responses(renderer, inputs, size, Region.whole(size), 6.0)

    found = approximated(ask, itself, 256, None, error)
    assert found.size < 256
    assert 1 - cosine(found.answer, ask(256)) <= error
    renderer.close()
