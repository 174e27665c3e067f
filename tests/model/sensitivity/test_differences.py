"""Sensitivity by differences of images, against the exact one and against moving shadows."""

from __future__ import annotations

import numpy as np
import pytest

from model.errors import RenderError
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.region import Region
from model.scene.scene import Lighting
from model.scene.tf_perturbation import edit_around, response_to_edits
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity import differences, exact

SIZE = 32
REGION = Region(4, 6, 28, 26)
RANGE = (0.0, 255.0)
COLOR = ColorTF(RANGE, ((0.0, 0.2, 0.3, 0.9), (255.0, 1.0, 0.6, 0.2)))
MODES = OpacityTF(RANGE, (GaussianMode(120.0, 40.0, 0.2), GaussianMode(220.0, 30.0, 0.4)))
FLAT = OpacityTF(RANGE, points=((0.0, 0.05), (255.0, 0.05)))
INPUTS = SceneInputs(View(35.0, 25.0, 7.0, 0.9), MODES, COLOR)


def cosine(one: np.ndarray, other: np.ndarray) -> float:
    one, other = one.ravel().astype(float), other.ravel().astype(float)
    return float(one @ other / np.linalg.norm(one) / np.linalg.norm(other))


@pytest.mark.parametrize("lighting", ["none", "direct"])
@pytest.mark.parametrize("opacity_tf", [MODES, FLAT])
def test_differences_are_near_the_exact_derivative(
    volume: Volume, lighting: Lighting, opacity_tf: OpacityTF
) -> None:
    inputs = SceneInputs(INPUTS.view, opacity_tf, COLOR)
    renderer = RaycastRenderer(volume, lighting)
    for value in (30.0, 140.0):
        edit = edit_around(value, RANGE, 6.0)
        expected = renderer.change(inputs, SIZE, edit)
        found = differences.value_sensitivity(renderer, inputs, SIZE, edit)
        assert found.dtype == np.float32
        assert cosine(found, expected) > 0.995
        assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(expected), rel=0.1)
    slopes = exact.region_sensitivity(renderer, inputs, SIZE, REGION)
    expected = response_to_edits(slopes, 6.0)
    found = differences.region_responses(renderer, inputs, SIZE, REGION, 6.0)
    assert np.abs(found - expected).max() < 0.1 * np.abs(expected).max()
    assert cosine(found, expected) > 0.995
    renderer.close()


def test_vtk_has_them_too(volume: Volume) -> None:
    renderer = VtkRenderer(volume)
    found = differences.value_sensitivity(renderer, INPUTS, SIZE, edit_around(140.0, RANGE, 6.0))
    renderer.close()
    expected = RaycastRenderer(volume).change(INPUTS, SIZE, edit_around(140.0, RANGE, 6.0))
    assert cosine(found, expected) > 0.98


def test_in_soft_light_an_edit_moves_the_shadow() -> None:
    # Light from the left; what is edited stands left of what is looked at.
    scalars = np.zeros((24, 24, 48), np.uint8)
    scalars[:, :, 8:16], scalars[:, :, 32:40] = 100, 250
    opacity_tf = OpacityTF(RANGE, (GaussianMode(250.0, 5.0, 0.9),))
    inputs = SceneInputs(View(0.0, 0.0), opacity_tf, COLOR)
    renderer = RaycastRenderer(Volume(scalars), "soft", LightDirection(-80.0, 0.0))
    change = differences.value_sensitivity(renderer, inputs, SIZE, edit_around(100.0, RANGE, 3.0))
    left, right = change[12:20, 8:11].mean(), change[12:20, 20:24].mean()
    assert left > 0
    assert abs(right) > 0.02 * left
    renderer.close()
    unlit = RaycastRenderer(Volume(scalars))
    shadowless = unlit.change(inputs, SIZE, edit_around(100.0, RANGE, 3.0))
    assert abs(shadowless[12:20, 20:24]).mean() < 0.1 * abs(right)
    unlit.close()


def test_a_black_region_has_none(volume: Volume) -> None:
    renderer = RaycastRenderer(volume, "soft")
    nothing = SceneInputs(INPUTS.view, OpacityTF(RANGE), COLOR)
    assert not differences.region_responses(renderer, nothing, SIZE, REGION, 6.0).any()
    with pytest.raises(RenderError, match="outside"):
        differences.region_responses(renderer, INPUTS, SIZE, Region(0, 0, 99, 9), 6.0)
    with pytest.raises(ValueError, match="1 bin"):
        differences.region_responses(renderer, INPUTS, SIZE, REGION, 0.5)
    renderer.close()


def test_an_edit_may_reach_what_is_transparent_and_what_is_opaque(volume: Volume) -> None:
    """Neither more nor less has room everywhere: each bin has a side of its own."""
    points = ((0.0, 0.0), (130.0, 0.0), (131.0, 1.0), (255.0, 1.0))
    inputs = SceneInputs(INPUTS.view, OpacityTF(RANGE, points=points), COLOR)
    renderer = RaycastRenderer(volume, sample_distance=1.0)
    edit = edit_around(130.0, RANGE, 12.0)
    expected = renderer.change(inputs, SIZE, edit)
    found = differences.value_sensitivity(renderer, inputs, SIZE, edit)
    renderer.close()
    assert cosine(found, expected) > 0.99
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(expected), rel=0.15)
