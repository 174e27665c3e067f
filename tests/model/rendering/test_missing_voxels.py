"""Missing voxels are transparent: beside closed forms, crop boxes and other fill values."""

from functools import partial

import numpy as np
import pytest
from drawing import drawn, rms

from model.latent.tiny_pictures import OVERVIEW_SIZE, overview_of
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.rendering.scalars import filled
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

RANGE = (0.0, 200.0)
COLOR = ColorTF(RANGE, ((0.0, 1.0, 0.2, 0.2), (200.0, 0.9, 0.8, 0.6)))
BALL_TF = OpacityTF(RANGE, (GaussianMode(200.0, 40.0, 0.3),))
OBLIQUE = View(azimuth=30.0, elevation=20.0)
SIZE = 48
EDGE = 32


def ball(dtype="float32"):
    z, y, x = np.mgrid[:EDGE, :EDGE, :EDGE] - (EDGE - 1) / 2
    return (200 * np.clip(13 - np.sqrt(x * x + y * y + z * z), 0, 1)).astype(dtype)


def half_ball(dtype="float32", fill=0.0):
    """The ball without what is measured at larger x than its middle."""
    voxels = ball(dtype)
    missing = np.zeros(voxels.shape, bool)
    missing[:, :, EDGE // 2 :] = True
    voxels[missing] = fill
    return Volume(voxels, missing=missing)


def inputs(opacity=BALL_TF, crop=None):
    return SceneInputs(OBLIQUE, opacity, COLOR, crop=crop)


def image(volume, name="raycast", given=None, **options):
    return drawn(partial(open_renderer, name), volume, given or inputs(), SIZE, **options)


@pytest.mark.parametrize("name", ["raycast", "vtk"])
def test_what_is_stored_where_nothing_was_measured_appears_nowhere(name):
    images = [
        image(half_ball(dtype, fill), name, lighting="direct")
        for dtype, fill in [("float32", -1e20), ("float32", 150), ("uint8", 199), ("uint8", 7)]
    ]
    assert images[0][..., 3].max() > 0.9
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[2], images[3])


@pytest.mark.parametrize("name", ["raycast", "vtk"])
def test_half_a_ball_is_the_ball_cut_in_two(name):
    """Its face lies halfway between the last measured voxels and the first missing ones."""
    cut = inputs(crop=CropBox((0.0, 0.0, 0.0), (0.5, 1.0, 1.0)))
    expected = image(Volume(ball()), "raycast", cut, sample_distance=0.1)
    found = image(half_ball(), name, sample_distance=0.1)
    assert rms(found - expected) < 0.006


@pytest.mark.parametrize("name", ["raycast", "vtk"])
def test_opacity_of_what_was_measured_is_that_of_its_length(name):
    """A homogeneous block of 24 voxels seen along z, of which 10 in the middle are missing."""
    voxels = np.full((24, 9, 9), 200, np.uint8)
    voxels[12, 4, 4] = 0
    missing = np.zeros(voxels.shape, bool)
    missing[7:17] = True
    voxels[12, 4, 4], voxels[0, 0, 0] = 90, 0
    flat = OpacityTF(RANGE, points=((0.0, 0.1), (200.0, 0.1)))
    given = SceneInputs(View(azimuth=0.0, elevation=90.0), flat, COLOR)
    found = image(Volume(voxels, missing=missing), name, given, sample_distance=0.05)
    # Half a voxel more than the 6 between the centres of the measured ones, on either side.
    # VTK leaves out the first and the last step, a tenth of a voxel in all.
    assert found[SIZE // 2, SIZE // 2, 3] == pytest.approx(1 - 0.9**13, abs=0.006)


@pytest.mark.parametrize("name", ["raycast", "vtk"])
def test_drawn_they_are_what_is_stored_there(name):
    volume = half_ball("uint8", 150)
    whole = Volume(volume.voxels)
    np.testing.assert_array_equal(image(volume.drawing_missing(True), name), image(whole, name))
    far = half_ball("float32", 1e20).drawing_missing(True)
    opaque = image(far, name)
    assert opaque[SIZE // 2, SIZE // 2 + 4, 3] > 0.9 and np.isfinite(opaque).all()


def test_the_overview_of_opacities_leaves_them_out():
    volume = half_ball(fill=200.0)
    overview = overview_of(volume, inputs(), BALL_TF.sample(RANGE)[None]).opacity[0]
    expected = drawn(RaycastRenderer, volume, inputs(), OVERVIEW_SIZE)[..., 3].mean()
    assert overview == pytest.approx(expected, abs=0.01)


def test_filled_voxels_are_means_of_their_neighbors():
    random = np.random.default_rng(1)
    voxels = random.normal(0, 10, (9, 8, 7))
    missing = random.random(voxels.shape) < 0.2
    missing[:, :, 3:] = True
    result = filled(voxels, missing, -5.0)
    np.testing.assert_array_equal(result[~missing], voxels[~missing])
    padded = np.pad(np.where(missing, np.nan, voxels), 1, constant_values=np.nan)
    for z, y, x in np.argwhere(missing):
        around = padded[z : z + 3, y : y + 3, x : x + 3]
        if not np.isnan(around).all():
            assert result[z, y, x] == pytest.approx(np.nanmean(around))
    # Two layers are filled, not three.
    assert (result[:, :, 4] != -5.0).all() and (result[:, :, 5:] == -5.0).all()
