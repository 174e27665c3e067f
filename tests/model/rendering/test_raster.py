from dataclasses import replace

import numpy as np
import pytest
import torch
from drawing import MODES, RAINBOW, constant, drawn, rms, slab

from model.rendering.raster import Raster, resized
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.view import View

INPUTS = SceneInputs(View(35.0, 20.0, 5.0, 0.8), MODES, RAINBOW)
SIZE = 32


@pytest.fixture(scope="module", params=[VtkRenderer, RaycastRenderer])
def renderer(request, volume):
    made = request.param(volume)
    yield made
    made.close()


def assert_same(one, other):
    # A pixel may fall on the other side of a face by rounding, or a step of 1/255 apart.
    assert rms(one - other) < 1 / 255
    assert np.mean(np.abs(one - other) > 2 / 255) < 0.01


def test_a_wide_picture_has_the_square_one_in_its_middle(renderer):
    wide = renderer.render(INPUTS, Raster(2 * SIZE, SIZE))
    assert wide.shape == (SIZE, 2 * SIZE, 4)
    assert_same(wide[:, SIZE // 2 : -SIZE // 2], renderer.render(INPUTS, SIZE))
    high = renderer.render(INPUTS, Raster(SIZE, 2 * SIZE))
    assert_same(high[SIZE // 2 : -SIZE // 2], renderer.render(INPUTS, SIZE))
    near = replace(INPUTS, view=replace(INPUTS.view, distance=0.3))
    # Closer, the volume fills what the square leaves out.
    assert renderer.render(near, Raster(2 * SIZE, SIZE))[:, : SIZE // 2].any()


def test_tiles_make_up_the_whole_picture(renderer):
    raster = Raster(40, 24)
    whole = renderer.render(INPUTS, raster)
    put_together = np.zeros_like(whole)
    for tile in raster.tiles(16, 10):
        part = np.s_[tile.top : tile.bottom, tile.left : tile.right]
        put_together[part] = renderer.render(INPUTS, tile)
    assert_same(put_together, whole)


def test_panning_moves_the_picture_as_it_is(renderer):
    still = renderer.render(INPUTS, SIZE)
    # A quarter of the image's height to the right, an eighth up.
    panned = replace(INPUTS, view=replace(INPUTS.view, pan_x=0.5, pan_y=0.25))
    moved = renderer.render(panned, SIZE)
    assert_same(moved[: -SIZE // 8, SIZE // 4 :], still[SIZE // 8 :, : -SIZE // 4])


# VTK has one sample more at a clipping plane, half a voxel long.
@pytest.mark.parametrize(("kind", "error"), [(VtkRenderer, 0.035), (RaycastRenderer, 1e-3)])
def test_a_cropped_slab_has_the_opacity_of_its_thickness(kind, error):
    crop = CropBox((0, 0.3, 0), (1, 0.8, 1))
    inputs = SceneInputs(View(0.0, 0.0), constant(0.1), RAINBOW, crop=crop)
    # 8 voxel lengths deep, of which half is shown.
    expected = 1 - 0.9 ** (0.5 * 8)
    assert drawn(kind, slab((9, 9, 9)), inputs, 33)[16, 16, 3] == pytest.approx(expected, abs=error)


def test_both_renderers_agree_on_panned_cropped_and_wide_pictures(volume):
    inputs = replace(
        INPUTS,
        view=replace(INPUTS.view, pan_x=-0.3, pan_y=0.2),
        crop=CropBox((0.2, 0.0, 0.1), (0.9, 0.7, 1.0)),
    )
    kinds = VtkRenderer, RaycastRenderer
    images = [drawn(kind, volume, inputs, Raster(60, 40)) for kind in kinds]
    assert rms(images[0] - images[1]) < 0.01
    assert images[0][..., 3].mean() > 0.03


def test_a_scaled_picture_keeps_its_proportions():
    whole = Raster(1200, 300)
    assert whole.scaled(0.5) == Raster(600, 150)
    assert whole.scaled(0.5).reach == whole.reach
    assert Raster(100, 80, 10, 10, 20, 20).scaled(2) == Raster(200, 160)
    assert whole.scaled(0.001) == Raster(16, 16)


def test_a_grown_part_ends_with_the_picture():
    part = Raster(100, 60, left=10, top=50, columns=30, rows=5)
    wide = part.grown(12)
    assert (wide.left, wide.right, wide.top, wide.bottom) == (0, 52, 38, 60)
    assert (wide.width, wide.height) == (100, 60)
    assert Raster(100, 60).grown(8) == Raster(100, 60, columns=100, rows=60)


@pytest.mark.parametrize("shape", [(7, 9), (20, 31), (5, 40)])
def test_pixels_between_are_interpolated_as_torch_does(shape):
    image = np.random.default_rng(0).random((5, 9, 4)).astype(np.float32)
    planes = torch.from_numpy(image).permute(2, 0, 1)[None]
    theirs = torch.nn.functional.interpolate(planes, shape, mode="bilinear")
    found = resized(image, shape)
    np.testing.assert_allclose(found, theirs[0].permute(1, 2, 0).numpy(), atol=1e-6)
