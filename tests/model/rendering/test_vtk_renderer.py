"""The reference renderer against closed forms and against itself turned around."""

from dataclasses import replace

import numpy as np
import pytest
from drawing import MODES, RAINBOW, VIEW, WHITE, constant, image_of, slab

from model.rendering.raster import Raster, middle_square
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

STEP = 1 / 255
SIZE = 64


@pytest.fixture(scope="module")
def renderer(volume):
    renderer = VtkRenderer(volume)
    yield renderer
    renderer.close()


@pytest.mark.parametrize("opacity", [2e-5, 9e-5, 1.1e-4])
@pytest.mark.parametrize("step", [0.25, 1.0])
def test_thin_haze_adds_up(opacity, step):
    volume, view = slab((9, 1201, 9)), View(distance=0.27)
    image = image_of(VtkRenderer, volume, view, constant(opacity), WHITE, 33, sample_distance=step)
    expected = 1 - np.exp(1200 * np.log1p(-opacity))
    assert image[16, 16, 3] == pytest.approx(expected, abs=1.5 * STEP)


@pytest.mark.parametrize("opacity", [0.02, 0.2, 0.6])
@pytest.mark.parametrize("step", [0.25, 0.5, 1.0])
def test_a_homogeneous_slab_absorbs_exponentially(opacity, step):
    tfs = constant(opacity), WHITE
    image = image_of(VtkRenderer, slab(), View(), *tfs, 65, sample_distance=step)
    # 1 - exp(-k l), where opacity a per voxel length means k = -log(1 - a); l is 8 voxels.
    expected = 1 - np.exp(8.0 * np.log1p(-opacity))
    # The ray has 8 / step samples; one more or less may fall on the faces.
    one_sample = (1 - expected) * -np.expm1(step * np.log1p(-opacity))
    assert image[32, 32, 3] == pytest.approx(expected, abs=1.5 * STEP + one_sample)


def test_images_do_not_depend_on_what_was_rendered_before(renderer):
    first = renderer.render(SceneInputs(VIEW, MODES, RAINBOW), SIZE)
    renderer.render(SceneInputs(View(200.0, -60.0), constant(0.4), WHITE), 32)
    assert np.array_equal(first, renderer.render(SceneInputs(VIEW, MODES, RAINBOW), SIZE))


@pytest.mark.parametrize(("scale", "offset"), [(1e-30, 0.0), (1e300, 0.0), (1.0, 1e9)])
def test_extreme_ranges_give_the_same_image(volume, scale, offset):
    scaled = Volume(volume.scalars.astype(np.float64) * scale + offset, volume.spacing)
    images = []
    for each in (volume, scaled):
        lo, hi = each.scalar_range
        tf = OpacityTF((lo, hi), points=((lo, 0.0), (hi, 0.6)))
        white = ColorTF((lo, hi), ((lo, 1.0, 1.0, 1.0),))
        images.append(image_of(VtkRenderer, each, VIEW, tf, white))
    np.testing.assert_allclose(images[1], images[0], atol=2.01 * STEP)


def test_volumes_far_from_the_origin_look_as_near_it(volume):
    far = 1e12
    moved = replace(volume, origin=(far, -far, 3 * far))
    near, there = (image_of(VtkRenderer, each, lighting="direct") for each in (volume, moved))
    assert near.max() > 0.1
    np.testing.assert_array_equal(there, near)


@pytest.mark.parametrize("raster", [Raster(1, 16383), Raster(2, 3000), Raster(3000, 2)])
def test_a_long_picture_shows_in_its_middle_what_a_square_one_does(renderer, raster):
    inputs = SceneInputs(VIEW, constant(0.3), RAINBOW)
    middle = middle_square(renderer.render(inputs, raster))
    square = renderer.render(inputs, raster.shorter)
    assert square[..., 3].max() > 0.9
    np.testing.assert_allclose(middle, square, atol=2.5 * STEP)
