"""Gradient shading and cast light, of the ray caster and its reference, against closed forms."""

import math
from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import pytest
from drawing import RANGE, constant, image_of, slab

from model.rendering.raycast import illumination
from model.rendering.raycast.illumination import AMBIENT, DIFFUSE, DISTANT, Illumination, SoftLight
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from tests import reference_light
from tests.benchmarks.extremes import picture, posed

BYTES = (0.0, 1.0)
GREY = ColorTF(RANGE, ((0.0, 0.5, 0.5, 0.5),))
BLACK = ColorTF(RANGE, ((0.0, 0.0, 0.0, 0.0),))
HEADLIGHT = LightDirection(0.0, 0.0)
LIGHTS = (LightDirection(), HEADLIGHT, LightDirection(60.0, -20.0), LightDirection(170.0, 10.0))


def towards(light, view):
    """World direction to the light: to the viewer's right by its azimuth, and up."""
    right, up, back = view.basis()
    azimuth, elevation = math.radians(light.azimuth), math.radians(light.elevation)
    level = math.sin(azimuth) * right + math.cos(azimuth) * back
    return math.cos(elevation) * level + math.sin(elevation) * up


# Gradient shading


# VTK shows 8 bits, and Mesa interpolates with weights of 8 bits, which tilts the normals a little.
@pytest.mark.parametrize(("kind", "error"), [(RaycastRenderer, 1e-3), (VtkRenderer, 5 / 255)])
def test_a_plane_reflects_by_the_cosine_of_the_lights_angle(kind, error):
    # A linear ramp, neither cubic nor isotropic, and its normal.
    normal = np.array([1.0, 0.5, -0.7]) / np.linalg.norm([1.0, 0.5, -0.7])
    spacing = (1.5, 0.8, 1.1)
    values = np.einsum("i,i...", normal * spacing, np.mgrid[0:11, 0:33, 0:25][::-1])
    values = 255 * (values - values.min()) / np.ptp(values)
    volume = Volume(values.astype(np.float32), spacing)
    # The plane through the volume's middle is the first that is seen, and opaque.
    opacity_tf = OpacityTF(RANGE, points=((126.0, 0.0), (127.0, 1.0)))
    # From where the values are low: that side of the plane is transparent.
    for light, view in product(LIGHTS, (View(-60.0, 20.0, 0.0, 0.8), View(-40.0, 50.0, 9.0, 0.7))):
        assert view.basis()[2] @ normal < -0.5
        options = {"lighting": "direct", "light": light, "sample_distance": 0.5}
        # Gloss is white, whatever the colour: the difference is diffuse light alone.
        gray, black = (
            image_of(kind, volume, view, opacity_tf, color, **options)[30:34, 30:34]
            for color in (GREY, BLACK)
        )
        assert (gray[..., 3] == 1).all()
        expected = DIFFUSE * abs(normal @ towards(light, view))
        np.testing.assert_allclose(2 * (gray - black)[..., :3], expected, atol=error)


# Cast light


@pytest.fixture(scope="module")
def executor():
    with ThreadPoolExecutor(1) as executor:
        yield executor


@pytest.mark.parametrize(
    ("azimuth", "elevation", "blur"),
    [(45, 0, 1e-4), (-45, 35, 2e-3), (30, 0, 0.08), (75, 35, 0.15)],
)
@pytest.mark.parametrize("opacity", [0.03, 0.2])
def test_light_fades_by_its_way_through_the_volume(
    azimuth, elevation, blur, opacity, executor, monkeypatch
):
    monkeypatch.setattr(illumination, "AMBIENT", 0.0)
    monkeypatch.setattr(illumination, "DISTANT", 1.0)
    light, volume = LightDirection(azimuth, elevation), slab((33, 33, 33))
    soft = SoftLight(-towards(light, View()), constant(opacity).sample(volume.scalar_range))
    grid = Illumination(volume.voxels, BYTES, volume, executor).grid(soft)
    assert grid.shape == volume.dimensions
    np.testing.assert_array_equal(grid.scale, 1)
    received = grid.grid.reshape(volume.voxels.shape)
    z, y, x = np.mgrid[0:33, 0:33, 0:33].astype(np.float64)
    # Back to where the light enters: half a voxel outside of the first and last ones.
    way = np.full(x.shape, np.inf)
    for place, step in zip((x, y, z), towards(light, View()), strict=True):
        if abs(step) > 1e-9:
            way = np.minimum(way, ((32.5 if step > 0 else -0.5) - place) / step)
    # A place does not stand in its own light: the last half of the way from layer to layer.
    way = np.maximum(way - 0.5 / np.abs(towards(light, View())).max(), 0)
    error = np.abs(received - (1 - opacity) ** way)
    # Light that falls between voxels blurs the edges between what comes through two faces.
    assert error.max() < blur
    assert error.mean() < 0.01


def test_light_on_a_coarser_grid_is_about_the_same(executor):
    # 160 voxels along y are more than the light's grid has.
    scalars = np.zeros((40, 160, 30), np.uint8)
    scalars[10:30, 40:80, 5:25] = 255
    volume = Volume(scalars, (1.0, 0.5, 1.0))
    opacity_tf = OpacityTF(RANGE, points=((250.0, 0.0), (255.0, 0.05)))
    soft = SoftLight(-towards(HEADLIGHT, View()), opacity_tf.sample(volume.scalar_range))
    grid = Illumination(scalars, BYTES, volume, executor).grid(soft)
    nx, ny, nz = grid.shape
    assert (nx, ny, nz) == (24, 64, 32)
    light = grid.grid.reshape(nz, ny, nx)
    for axis, places in enumerate(grid.shape):
        assert (places - 1) / grid.scale[axis] == pytest.approx(volume.dimensions[axis] - 1)
    # Opacities are per voxel size, which is the cube root of a half; the block is 20 units deep.
    shadow = 0.95 ** (20 / 0.5 ** (1 / 3))
    ambient = (light[16, 60, 12] - DISTANT * shadow) / AMBIENT
    assert 0.3 < ambient < 1


UNIT_WHITE = ColorTF((0.0, 1.0), ((0.0, 1.0, 1.0, 1.0),))


def even(opacity):
    return OpacityTF((0.0, 1.0), points=((0.0, opacity),))


def test_what_is_homogeneous_is_half_lit_inside_and_by_its_faces_outside():
    """A headlight on an opaque slab: the face in front has all of the diffuse light and gloss."""
    scalars = np.full((9, 9, 9), 0.5, np.float32)
    scalars[0, 0, 0], scalars[-1, -1, -1] = 0, 1
    for light, exact in (((0.0, 0.0), 1.0), ((60.0, 0.0), 0.45)):
        inputs = SceneInputs(View(), even(1.0), UNIT_WHITE, LightDirection(*light))
        image = reference_light.picture(Volume(scalars), inputs, 1, 0.25, "direct")
        assert image[0, 0, 0] == pytest.approx(exact, abs=0.01)


@pytest.mark.parametrize("lighting", ["direct", "soft"])
@pytest.mark.parametrize("opacity", [1e-12, 1e-3])
def test_a_faint_picture_is_lit_as_a_bright_one(lighting, opacity):
    assert picture(lighting, posed(curve=((0.0, opacity),))) < 0.003
