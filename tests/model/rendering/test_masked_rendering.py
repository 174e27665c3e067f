"""Masks leave voxels out in every renderer, as in the reference, crop boxes and one another."""

import gc
import weakref
from functools import partial

import numpy as np
import pytest
from drawing import MODES, RAINBOW, VIEW, drawn, rms

from model.errors import TfscopeError
from model.latent.tiny_pictures import OVERVIEW_SIZE, overview_of
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.volume import Volume
from tests import reference_light

EDGE, SIZE = 24, 32


@pytest.fixture(scope="module")
def volume():
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, EDGE),) * 3, indexing="ij")
    values = np.exp(-(x**2 + y**2 + z**2) / 0.5) + 0.1 * np.sin(5 * x + 3 * y)
    missing = np.zeros(values.shape, bool)
    missing[2:5, 8:12, 10:14] = True
    values = np.rint(255 * (values - values.min()) / np.ptp(values)).astype(np.uint8)
    return Volume(values, (1.2, 0.8, 1.0), missing=missing).over((0.0, 255.0))


def half(axis=2, part=slice(EDGE // 2, None)):
    shown = np.ones((EDGE,) * 3, bool)
    np.moveaxis(shown, axis, 0)[part] = False
    return Mask.of(shown)


def inputs(mask=None, crop=None):
    return SceneInputs(VIEW, MODES, RAINBOW, mask=mask, crop=crop)


@pytest.mark.parametrize("lighting", ["none", "direct", "soft"])
def test_the_ray_caster_draws_what_the_reference_draws(volume, lighting):
    mask = Mask.of(np.random.default_rng(1).random(volume.voxels.shape) < 0.6)
    expected = reference_light.picture(volume, inputs(mask), SIZE, 0.5, lighting)
    found = drawn(RaycastRenderer, volume, inputs(mask), SIZE, lighting)
    np.testing.assert_allclose(found, expected, atol=4e-3)


@pytest.mark.parametrize("name", ["raycast", "vtk"])
def test_half_a_volume_is_the_volume_cut_in_two(volume, name):
    """The face of what is shown lies halfway between two voxels."""
    cut = (EDGE // 2 - 0.5) / (EDGE - 1)
    crop = CropBox((0.0, 0.0, 0.0), (cut, 1.0, 1.0))
    opened = partial(open_renderer, name)
    expected = drawn(opened, volume, inputs(crop=crop), SIZE, sample_distance=0.1)
    found = drawn(opened, volume, inputs(half()), SIZE, sample_distance=0.1)
    assert rms(found - expected) < 0.006 and expected[..., 3].max() > 0.9


@pytest.mark.parametrize(
    ("name", "lighting"),
    [*(("raycast", light) for light in ("none", "direct", "soft", "path")), ("vtk", "none")],
)
def test_a_renderer_draws_with_one_mask_after_another_and_without(volume, name, lighting):
    given = [inputs(), inputs(half()), inputs(half(0)), inputs(half()), inputs()]
    renderer = open_renderer(name, volume, lighting)
    try:
        images = [renderer.render(each, SIZE) for each in given]
    finally:
        renderer.close()
    for each, image in zip(given, images, strict=True):
        expected = drawn(partial(open_renderer, "raycast"), volume, each, SIZE, lighting)
        assert rms(image - expected) <= (0.01 if name == "vtk" else 0)
    assert rms(images[0] - images[1]) > 0.05 and rms(images[1] - images[2]) > 0.05


def test_paths_meet_nothing_where_nothing_is_shown(volume):
    found = drawn(PathTracer, volume, inputs(half()), SIZE)
    opacity = drawn(RaycastRenderer, volume, inputs(half()), SIZE)[..., 3]
    np.testing.assert_allclose(found[..., 3], opacity, atol=2e-3)


def test_the_overview_of_opacities_leaves_hidden_voxels_out(volume):
    tf = MODES.sample((0.0, 255.0))[None]
    found = overview_of(volume, inputs(half()), tf).opacity[0]
    expected = drawn(RaycastRenderer, volume, inputs(half()), OVERVIEW_SIZE)[..., 3].mean()
    assert found == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize("name", ["raycast", "vtk"])
def test_a_mask_of_another_grid_is_refused(volume, name):
    other = Mask.of(np.eye(EDGE, dtype=bool)[None].repeat(3, axis=0))
    with pytest.raises(TfscopeError, match="24 × 24 × 3 voxels is not of this volume"):
        drawn(partial(open_renderer, name), volume, inputs(other), SIZE)


@pytest.mark.parametrize("kind", [RaycastRenderer, PathTracer])
def test_nothing_keeps_the_voxels_of_a_closed_renderer(volume, kind):
    gc.disable()
    try:
        renderer = kind(volume)
        kept = weakref.ref(renderer)
        renderer.close()
        del renderer
        assert kept() is None
    finally:
        gc.enable()
