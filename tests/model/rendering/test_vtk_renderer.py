"""The reference renderer against closed forms and against itself turned around."""

import threading
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from model.rendering.raster import Raster, middle_square
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

STEP = 1 / 255
SIZE = 64
RANGE = (0.0, 255.0)
WHITE = ColorTF(RANGE, ((0.0, 1.0, 1.0, 1.0),))
RAINBOW = ColorTF(RANGE, ((0.0, 0.1, 0.2, 0.9), (100.0, 0.9, 0.8, 0.1), (255.0, 1.0, 0.3, 0.2)))
MODES = OpacityTF(RANGE, (GaussianMode(120.0, 40.0, 0.2), GaussianMode(220.0, 30.0, 0.5)))
VIEW = View(35.0, 25.0, 7.0, 0.9)


@pytest.fixture(scope="module")
def renderer(volume):
    renderer = VtkRenderer(volume)
    yield renderer
    renderer.close()


def render(volume, view, opacity_tf, color_tf, size, **options):
    renderer = VtkRenderer(volume, **options)
    image = renderer.render(SceneInputs(view, opacity_tf, color_tf), size)
    renderer.close()
    return image


def constant(opacity):
    return OpacityTF(RANGE, points=((0.0, opacity), (255.0, opacity)))


def slab(nx=33, ny=9, nz=33, spacing=(1.0, 1.0, 1.0)):
    """A nearly constant volume: one corner differs, since constant volumes are refused."""
    scalars = np.full((nz, ny, nx), 128, np.uint8)
    scalars[0, 0, 0] = 0
    scalars[-1, -1, -1] = 255
    return Volume(scalars, spacing)


@pytest.mark.parametrize("opacity", [2e-5, 9e-5, 1.1e-4])
@pytest.mark.parametrize("sample_distance", [0.25, 1.0])
def test_thin_haze_adds_up(opacity, sample_distance):
    volume = slab(9, 1201, 9)
    view = View(distance=0.27)
    image = render(volume, view, constant(opacity), WHITE, 33, sample_distance=sample_distance)
    expected = 1 - np.exp(1200 * np.log1p(-opacity))
    assert image[16, 16, 3] == pytest.approx(expected, abs=1.5 * STEP)


@pytest.mark.parametrize("opacity", [0.02, 0.2, 0.6])
@pytest.mark.parametrize("sample_distance", [0.25, 0.5, 1.0])
def test_a_homogeneous_slab_absorbs_exponentially(opacity, sample_distance):
    volume = slab()
    image = render(volume, View(), constant(opacity), WHITE, 65, sample_distance=sample_distance)
    # 1 - exp(-k l), where opacity a per voxel length means k = -log(1 - a); l is 8 voxels.
    expected = 1 - np.exp(8.0 * np.log1p(-opacity))
    # The ray has 8 / step samples; one more or less may fall on the faces.
    one_sample = (1 - expected) * -np.expm1(sample_distance * np.log1p(-opacity))
    assert image[32, 32, 3] == pytest.approx(expected, abs=1.5 * STEP + one_sample)


def test_looking_from_above_shows_the_top(volume):
    scalars = np.zeros((17, 17, 17), np.uint8)
    scalars[12:16, 7:10, 7:10] = 255
    volume = Volume(scalars)
    tf = OpacityTF(RANGE, points=((100.0, 0.0), (200.0, 1.0)))
    front = render(volume, View(0.0, 0.0), tf, WHITE, SIZE)[..., 3]
    # The block sits near the top of z, so from the front it is in the upper half: row 0 is the top.
    assert front[: SIZE // 2].sum() > 10 * front[SIZE // 2 :].sum()
    scalars = np.zeros((17, 17, 17), np.uint8)
    scalars[7:10, 7:10, 12:16] = 255
    right = render(Volume(scalars), View(0.0, 0.0), tf, WHITE, SIZE)[..., 3]
    assert right[:, SIZE // 2 :].sum() > 10 * right[:, : SIZE // 2].sum()


def test_roll_turns_the_picture_clockwise(volume):
    straight = render(volume, View(20.0, 10.0, 0.0), MODES, RAINBOW, SIZE)
    rolled = render(volume, View(20.0, 10.0, 90.0), MODES, RAINBOW, SIZE)
    assert np.abs(np.rot90(straight, -1) - rolled).mean() < 0.5 * STEP


def test_images_do_not_depend_on_what_was_rendered_before(renderer):
    first = renderer.render(SceneInputs(VIEW, MODES, RAINBOW), SIZE)
    renderer.render(SceneInputs(View(200.0, -60.0), constant(0.4), WHITE), 32)
    assert np.array_equal(first, renderer.render(SceneInputs(VIEW, MODES, RAINBOW), SIZE))


@pytest.mark.parametrize("dtype", ["int8", "uint16", "float32", "float64"])
def test_every_scalar_type_gives_the_same_image(volume, dtype):
    # Half of 255 fits int8.
    scalars = volume.scalars // 2
    as_bytes = Volume(scalars, volume.spacing)
    other = Volume(scalars.astype(dtype), volume.spacing)
    np.testing.assert_allclose(
        render(other, VIEW, MODES, RAINBOW, SIZE),
        render(as_bytes, VIEW, MODES, RAINBOW, SIZE),
        atol=2.01 * STEP,
    )


@pytest.mark.parametrize(("scale", "offset"), [(1e-30, 0.0), (1e300, 0.0), (1.0, 1e9)])
def test_extreme_ranges_give_the_same_image(volume, scale, offset):
    scaled = Volume(volume.scalars.astype(np.float64) * scale + offset, volume.spacing)
    lo, hi = scaled.scalar_range
    tf = OpacityTF((lo, hi), points=((lo, 0.0), (hi, 0.6)))
    plain = OpacityTF(RANGE, points=((0.0, 0.0), (255.0, 0.6)))
    np.testing.assert_allclose(
        render(scaled, VIEW, tf, ColorTF((lo, hi), ((lo, 1.0, 1.0, 1.0),)), SIZE),
        render(volume, VIEW, plain, WHITE, SIZE),
        atol=2.01 * STEP,
    )


def test_every_elevation_with_roll_gives_a_continuous_image(renderer):
    images = [
        renderer.render(SceneInputs(View(10.0, float(e), 5.0), MODES, RAINBOW), 32)
        for e in range(-90, 91, 3)
    ]
    changes = [np.abs(a - b).mean() for a, b in pairwise(images)]
    assert max(changes) < 5 * np.median(changes)


def test_the_whole_volume_is_in_view_at_distance_1(renderer):
    for azimuth in range(0, 360, 30):
        alpha = renderer.render(
            SceneInputs(View(azimuth, 35.0, 0.0, 1.0), constant(1.0), WHITE), SIZE
        )[..., 3]
        edge = np.concatenate([alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]])
        assert not edge.any()


def test_a_renderer_works_in_a_thread_of_its_own(volume):
    images = []
    thread = threading.Thread(
        target=lambda: images.append(render(volume, VIEW, MODES, RAINBOW, SIZE))
    )
    thread.start()
    thread.join()
    assert np.array_equal(images[0], render(volume, VIEW, MODES, RAINBOW, SIZE))


def test_volumes_far_from_the_origin_look_as_near_it(volume):
    far = 1e12
    moved = replace(volume, origin=(far, -far, 3 * far))
    near, there = (
        render(v, VIEW, MODES, RAINBOW, SIZE, lighting="direct") for v in (volume, moved)
    )
    assert near.max() > 0.1
    np.testing.assert_array_equal(there, near)


@pytest.mark.parametrize("raster", [Raster(1, 16383), Raster(2, 3000), Raster(3000, 2)])
def test_a_long_picture_shows_in_its_middle_what_a_square_one_does(renderer, raster):
    inputs = SceneInputs(VIEW, constant(0.3), RAINBOW)
    middle = middle_square(renderer.render(inputs, raster))
    square = renderer.render(inputs, raster.shorter)
    assert square[..., 3].max() > 0.9
    np.testing.assert_allclose(middle, square, atol=2.5 * STEP)
