from functools import partial

import numpy as np
import pytest
from drawing import constant, drawn, slab

from model.rendering.renderer import open_renderer
from model.rendering.scalars import noise_of
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

RANGE = (0.0, 200.0)
WHITE = ColorTF(RANGE, ((0.0, 1.0, 1.0, 1.0), (200.0, 1.0, 1.0, 1.0)))
SOLID = OpacityTF(RANGE, points=((0.0, 0.0), (80.0, 0.0), (120.0, 0.95), (200.0, 0.95)))
HEADLIGHT = LightDirection(0.0, 0.0)
LOWER = CropBox((0.0, 0.0, 0.0), (1.0, 1.0, 0.55))
SIZE = 96
EDGE = 48

DIFFUSE, SPECULAR, POWER = 0.9, 0.2, 20
"""Of both renderers."""


def block(noise=0.0):
    """Material that fills its volume, but for one voxel."""
    voxels = 150 + np.random.default_rng(4).normal(0, 1, (EDGE,) * 3) * noise
    voxels[0, 0, 0], voxels[0, 0, 1] = 0.0, 200.0
    return Volume(voxels.astype(np.float32))


def ball(noise=0.0):
    z, y, x = np.mgrid[:EDGE, :EDGE, :EDGE] - (EDGE - 1) / 2
    inside = np.clip(18.5 - np.sqrt(x * x + y * y + z * z), 0, 1)
    voxels = 180 * inside + np.random.default_rng(4).normal(0, 1, inside.shape) * noise
    return Volume(np.clip(np.rint(voxels), 0, 200).astype(np.uint8), (1.0, 1.0, 1.0)).over(RANGE)


def render(name, volume, view, crop=None, **options):
    inputs = SceneInputs(view, SOLID, WHITE, crop=crop)
    return drawn(partial(open_renderer, name), volume, inputs, SIZE, "direct", HEADLIGHT, **options)


def face_light(view, row, column, normal):
    """Blinn's predecessor Phong, of a headlight on a face, at a pixel."""
    right, up, back = view.basis()
    tangent = np.tan(np.radians(15.0))
    x, y = (2 * column + 1) / SIZE - 1, 1 - (2 * row + 1) / SIZE
    ray = -back + tangent * (x * right + y * up)
    ray /= np.linalg.norm(ray)
    normal = normal if normal @ back > 0 else -normal
    mirrored = 2 * (normal @ back) * normal - back
    gloss = max(0.0, float(mirrored @ -ray)) ** POWER
    return DIFFUSE * float(normal @ back) + SPECULAR * gloss


@pytest.mark.parametrize("name", ["raycast", "vtk"])
@pytest.mark.parametrize("noise", [0.0, 4.0])
def test_a_cut_face_is_lit_by_its_normal(name, noise):
    view = View(azimuth=20.0, elevation=60.0)
    for volume in (block(noise), ball(noise)):
        found = render(name, volume, view, LOWER, sample_distance=0.05)
        middle = found[SIZE // 2 - 3 : SIZE // 2 + 3, SIZE // 2 - 3 : SIZE // 2 + 3]
        face = face_light(view, SIZE // 2, SIZE // 2, np.array([0.0, 0.0, 1.0]))
        assert middle[..., 3].min() > 0.98
        # By the face's normal down to half a voxel, less and less to a voxel, evenly below.
        depth = np.linspace(0, 6, 6001)
        share = np.clip(2 - 2 * depth, 0, 1)
        clear = 0.05 ** (depth / view.basis()[2][2])
        light = share * face + (1 - share) * DIFFUSE / 2
        expected = np.sum(-np.diff(clear) * (light[1:] + light[:-1]) / 2)
        assert middle[..., 0].mean() == pytest.approx(expected, abs=0.015)
        assert middle[..., 0].std() < 0.03


@pytest.mark.parametrize("dtype", ["float32", "uint8"])
@pytest.mark.parametrize("sigma", [0.0, 2.0, 7.0])
def test_noise_is_that_of_the_material_not_of_the_air(dtype, sigma):
    z, y, x = np.mgrid[:60, :60, :60] - 29.5
    material = x * x + 2 * y * y + z * z < 22**2
    random = np.random.default_rng(9).normal(0, sigma, material.shape)
    voxels = np.where(material, 120 + 0.4 * x + random, 0.0)
    rounded = np.rint(voxels) if dtype != "float32" else voxels
    # Rounding is noise, too: its variance is 1/12.
    expected = np.hypot(sigma, np.sqrt(1 / 12) if dtype != "float32" and sigma else 0)
    assert noise_of(rounded.astype(dtype)) == pytest.approx(expected, rel=0.12, abs=0.35)


def test_noise_of_smooth_and_of_small_volumes_is_none():
    z, y, x = np.meshgrid(*[np.linspace(-1, 1, 40)] * 3, indexing="ij")
    smooth = np.exp(-3 * (x * x + y * y + z * z)).astype(np.float32)
    assert noise_of(smooth) < 1e-4
    assert noise_of(np.arange(8.0).reshape(2, 2, 2)) == 0.0


@pytest.mark.parametrize("flat", [1, 1000])
@pytest.mark.parametrize("name", ["raycast", "vtk"])
def test_what_is_thinner_than_a_step_is_as_opaque_as_its_length(name, flat):
    volume = Volume(slab((5, 40, 40)).voxels, (flat, flat, 1.0))
    inputs = SceneInputs(View(azimuth=0.0, elevation=90.0), constant(0.6), WHITE)
    found = drawn(partial(open_renderer, name), volume, inputs, 64)[32, 32, 3]
    assert found == pytest.approx(1 - 0.4 ** (4 / volume.voxel_size), abs=0.003)


def test_vtks_picture_does_not_depend_on_the_unit_of_length():
    voxels, inputs = ball().voxels, SceneInputs(View(), SOLID, WHITE, crop=LOWER)
    images = [
        drawn(VtkRenderer, Volume(voxels, (unit, unit, 2 * unit)).over(RANGE), inputs, 48, "direct")
        for unit in (1.0, 1e-9, 1e6)
    ]
    for image in images[1:]:
        assert np.abs(image - images[0]).max() <= 2 / 255
