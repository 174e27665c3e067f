"""Light on solid material that is cut off, in both renderers, against closed forms."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from model.rendering.raycast.illumination import DIFFUSE
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

RANGE = (0.0, 200.0)
GRAY = ColorTF(RANGE, ((0.0, 0.5, 0.5, 0.5),))
BLACK = ColorTF(RANGE, ((0.0, 0.0, 0.0, 0.0),))
OPAQUE = OpacityTF(RANGE, points=((80.0, 0.0), (120.0, 1.0)))
LIGHTS = (LightDirection(), LightDirection(60.0, -20.0), LightDirection(10.0, 80.0))
KINDS = (RaycastRenderer, VtkRenderer)
HALF = CropBox((0.0, 0.0, 0.0), (1.0, 0.5, 1.0))
TOP = CropBox((0.0, 0.0, 0.0), (1.0, 1.0, 0.5))
FRONTS = ((1, View(20.0, 15.0)), (0, View(110.0, 15.0)), (2, View(20.0, 75.0)))
"""Views that have a face across an axis in their middle."""


def towards(light: LightDirection, view: View) -> NDArray[np.float64]:
    """World direction to the light."""
    return np.array(light.towards()) @ view.basis()


def block(spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Volume:
    """A specimen that fills its volume, with a denser core."""
    scalars = np.full((48, 48, 48), 150, np.uint8)
    scalars[10:38, 10:38, 10:38], scalars[0, 0, 0] = 200, 0
    return Volume(scalars, spacing)


def ball(noise: float = 0.0) -> Volume:
    z, y, x = np.mgrid[-1:1:48j, -1:1:48j, -1:1:48j]
    values = 160 * np.clip(15 * (0.75 - np.sqrt(x**2 + y**2 + z**2)), 0, 1) + 20
    values += np.random.default_rng(2).normal(0, noise, values.shape) if noise else 0
    values[0, 0, 0], values[-1, -1, -1] = 0, 200
    return Volume(np.clip(values, 0, 200).astype(np.uint8))


def images(
    volume: Volume, inputs: SceneInputs, size: int = 64, **options: Any
) -> list[NDArray[np.float32]]:
    """The ray caster's image and VTK's, in direct light."""
    found = []
    for kind in KINDS:
        renderer = kind(volume, "direct", **options)
        found.append(renderer.render(inputs, size))
        renderer.close()
    return found


def diffuse(volume: Volume, view: View, tf: OpacityTF, **options: Any) -> list[NDArray[np.float32]]:
    """Diffuse factors in the middle of the images: gloss is white, whatever the colour."""
    crop = options.pop("crop", None)
    gray, black = (
        images(volume, SceneInputs(view, tf, color, crop=crop), **options)
        for color in (GRAY, BLACK)
    )
    return [2 * (g - b)[29:35, 29:35, 0] for g, b in zip(gray, black, strict=True)]


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (1e-9, 2e-9, 1.5e-9), (2e6, 1e6, 1e6)])
def test_an_opaque_block_reflects_as_its_faces_do(spacing: tuple[float, float, float]) -> None:
    for (axis, view), light in product(FRONTS, LIGHTS):
        expected = DIFFUSE * abs(np.eye(3)[axis] @ towards(light, view))
        for found in diffuse(block(spacing), view, OPAQUE, light=light):
            np.testing.assert_allclose(found, expected, atol=5 / 255)


@pytest.mark.parametrize("step", [0.25, 0.5, 1.0])
def test_a_cut_face_reflects_as_a_plane_whatever_the_step(step: float) -> None:
    view, light = View(0.0, 60.0), LightDirection(40.0, 30.0)
    expected = DIFFUSE * abs(towards(light, view)[2])
    found = diffuse(ball(), view, OPAQUE, light=light, crop=TOP, sample_distance=step)
    for image in found:
        np.testing.assert_allclose(image, expected, atol=5 / 255)


def test_haze_is_lit_evenly_behind_its_face() -> None:
    """Front to back: a voxel by the face, another by both, all behind evenly."""
    volume = Volume(np.pad(np.full((31, 33, 33), 128, np.uint8), ((0, 2), (0, 0), (0, 0))))
    opacity, view, light = 0.2, View(0.0), LightDirection(60.0, 0.0)
    tf = OpacityTF((0.0, 128.0), points=((0.0, opacity),))
    sample = 1 - (1 - opacity) ** 0.5
    face, even = DIFFUSE * math.cos(math.radians(60)), DIFFUSE / 2
    expected, through = 0.0, 1.0
    for n in range(1, 65):
        share = min(max(2 - n * 0.5, 0), 1)
        expected += through * sample * (share * face + (1 - share) * even)
        through *= 1 - sample
    for found in diffuse(volume, view, tf, light=light):
        np.testing.assert_allclose(found, expected, atol=6 / 255)


@pytest.mark.parametrize("name", ["block", "ball", "scan"])
def test_both_renderers_agree_on_solid_material(name: str) -> None:
    volume = {"block": block(), "ball": ball(), "scan": ball(8.0)}[name]
    crops = (None, HALF, CropBox((0.0, 0.0, 0.4), (0.7, 1.0, 1.0)))
    for crop, view in product(crops, (View(35.0, 25.0, 7.0), View(200.0, -40.0))):
        # VTK leaves out the last step of each ray, which shows along edges: a short one.
        inputs = SceneInputs(view, OPAQUE, GRAY, crop=crop)
        one, other = images(volume, inputs, 96, sample_distance=0.25)
        assert np.sqrt(np.mean((one - other)[..., :3] ** 2)) < 0.02
        solid = (one[..., 3] > 0.99) & (other[..., 3] > 0.99)
        assert solid.sum() > 300
        assert np.sqrt(np.mean((one - other)[solid] ** 2)) < 0.01


def test_noise_is_not_taken_for_a_surface() -> None:
    """A cut through a noisy ball is as even as one through the ball without noise."""
    view, light = View(0.0, 60.0), LightDirection(0.0, 30.0)
    inside = OpacityTF(RANGE, points=((80.0, 0.0), (120.0, 0.4)))
    for clean, noisy in zip(
        diffuse(ball(), view, inside, light=light, crop=TOP),
        diffuse(ball(8.0), view, inside, light=light, crop=TOP),
        strict=True,
    ):
        assert clean.mean() > 0.3
        np.testing.assert_allclose(noisy, clean.mean(), atol=0.06)


def test_a_surface_keeps_its_normal_away_from_faces() -> None:
    """The ball's own surface is lit by its gradient, in spite of noise."""
    for noise, most in ((0.0, 4 / 255), (4.0, 0.1)):
        view, light = View(30.0, 20.0), LightDirection(30.0, 10.0)
        expected = DIFFUSE * abs(view.basis()[2] @ towards(light, view))
        for found in diffuse(ball(noise), view, OPAQUE, light=light):
            assert abs(found.mean() - expected) < most


@pytest.mark.parametrize("lighting", ["none", "direct", "global"])
def test_vtks_picture_does_not_depend_on_the_unit_of_length(lighting: Any) -> None:
    found = []
    for unit in (1.0, 1e-9, 1e-3, 1e6):
        renderer = VtkRenderer(block((unit, 1.5 * unit, 0.8 * unit)), lighting)
        found.append(renderer.render(SceneInputs(View(35.0, 25.0), OPAQUE, GRAY, crop=HALF), 48))
        renderer.close()
    assert found[0][..., :3].max() > 0.2
    for other in found[1:]:
        np.testing.assert_allclose(other, found[0], atol=2 / 255)
