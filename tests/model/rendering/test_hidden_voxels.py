"""What is missing or hidden by a mask is drawn nowhere: against the reference and crop boxes."""

import gc
import weakref
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from drawing import MODES, RAINBOW, RANGE, VIEW, WHITE, constant, drawn, rms, slab

from model.errors import TfscopeError
from model.latent.tiny_pictures import OVERVIEW_SIZE, overview_of
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.scene import filling
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.transfer_function import OpacityTF
from model.scene.view import View
from model.volume_files.finish import make_volume
from model.volume_files.grid import Grid
from tests import reference_light

EDGE, SIZE = 24, 32
BLOCK = np.zeros((EDGE,) * 3, bool)
BLOCK[2:5, 8:12, 10:14] = True


def stored(dtype="uint8", number=0.0):
    """A blob as it is read, of which a block is missing, where a number is stored."""
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, EDGE),) * 3, indexing="ij")
    values = np.exp(-(x**2 + y**2 + z**2) / 0.5) + 0.1 * np.sin(5 * x + 3 * y)
    values = np.rint(255 * (values - values.min()) / np.ptp(values))
    voxels = np.where(BLOCK, number, values).astype(dtype)
    grid = Grid(voxels, (1.2, 0.8, 1.0), missing=BLOCK)
    return make_volume(Path("blob.raw"), grid).over(RANGE)


@pytest.fixture(scope="module")
def volume():
    return stored()


def half(axis=2):
    shown = np.ones((EDGE,) * 3, bool)
    np.moveaxis(shown, axis, 0)[EDGE // 2 :] = False
    return Mask.of(shown)


def inputs(mask=None, crop=None):
    return SceneInputs(VIEW, MODES, RAINBOW, mask=mask, crop=crop)


def opened(name):
    return partial(open_renderer, name)


def without_half(volume, how):
    """Volume and inputs by which a half is missing, or hidden by a mask."""
    if how == "mask":
        return volume, inputs(half())
    missing = BLOCK | ~half().shown
    voxels = filling.fill(volume.voxels.copy(), missing)
    return replace(volume, voxels=voxels, missing=missing), inputs()


both = pytest.mark.parametrize("how", ["mask", "missing"])
renderers = pytest.mark.parametrize("name", ["raycast", "vtk"])


@pytest.mark.parametrize("lighting", ["none", "direct", "soft"])
def test_the_ray_caster_draws_what_the_reference_draws(volume, lighting):
    mask = Mask.of(np.random.default_rng(1).random(volume.voxels.shape) < 0.6)
    expected = reference_light.picture(volume, inputs(mask), SIZE, 0.5, lighting)
    found = drawn(RaycastRenderer, volume, inputs(mask), SIZE, lighting)
    np.testing.assert_allclose(found, expected, atol=6e-3)


@both
@renderers
def test_half_a_volume_is_the_volume_cut_in_two(volume, name, how):
    """The face of what is shown lies halfway between two voxels."""
    cut = (EDGE // 2 - 0.5) / (EDGE - 1)
    crop = CropBox((0.0, 0.0, 0.0), (cut, 1.0, 1.0))
    expected = drawn(opened(name), volume, inputs(crop=crop), SIZE, sample_distance=0.1)
    found = drawn(opened(name), *without_half(volume, how), SIZE, sample_distance=0.1)
    assert rms(found - expected) < 0.006 and expected[..., 3].max() > 0.9


@renderers
@pytest.mark.parametrize("opacity", [0.02, 0.3, 0.9])
def test_through_a_masks_edge_comes_what_a_ramp_over_one_voxel_lets_through(name, opacity):
    shown = np.ones((33, 9, 33), bool)
    shown[:, 5:] = False
    given = SceneInputs(View(), constant(opacity), WHITE, mask=Mask.of(shown))
    found = drawn(opened(name), slab(), given, 33, sample_distance=0.05)[16, 16, 3]
    # Four voxels, and the integral of log(1 - w opacity) from w = 0 to 1.
    clear = 4 * np.log1p(-opacity) - 1 - (1 - opacity) / opacity * np.log1p(-opacity)
    assert found == pytest.approx(-np.expm1(clear), abs=4e-3)


@renderers
def test_what_is_stored_where_nothing_was_measured_does_not_appear(name):
    for dtype, numbers in (("float32", (-1e20, 150)), ("uint8", (199, 7))):
        one, other = (
            drawn(opened(name), stored(dtype, number), inputs(), SIZE, lighting="direct")
            for number in numbers
        )
        assert one[..., 3].max() > 0.9
        np.testing.assert_array_equal(one, other)


@renderers
def test_values_that_a_mask_hides_do_not_appear_at_its_edge(name):
    one, other = (
        drawn(
            opened(name),
            replace(stored(number=number), missing=None),
            inputs(Mask.of(~BLOCK)),
            SIZE,
        )
        for number in (199, 7)
    )
    np.testing.assert_array_equal(one, other)


@renderers
def test_a_surface_stays_when_lower_values_next_to_it_are_hidden(name, volume):
    lo, hi = RANGE
    middle = lo + 0.4 * (hi - lo)
    surface = OpacityTF(RANGE, points=((middle, 0.0), (middle + 0.2 * (hi - lo), 0.8), (hi, 0.8)))
    given = replace(inputs(), opacity_tf=surface)
    masked = replace(given, mask=Mask.of(volume.voxels >= middle))
    one, other = (
        drawn(opened(name), replace(volume, missing=None), each, SIZE, lighting="direct")
        for each in (given, masked)
    )
    assert rms(one - other) < 0.008 and one[..., 3].max() > 0.9


@pytest.mark.parametrize(
    ("name", "lighting"),
    [*(("raycast", light) for light in ("none", "direct", "soft", "path")), ("vtk", "none")],
)
def test_a_renderer_draws_with_one_mask_after_another_and_without(volume, name, lighting):
    given = [inputs(), inputs(half()), inputs(half(0)), inputs(half()), inputs()]
    renderer = open_renderer(name, volume, lighting)
    images = [renderer.render(each, SIZE) for each in given]
    for each, image in zip(given, images, strict=True):
        expected = drawn(opened("raycast"), volume, each, SIZE, lighting)
        assert rms(image - expected) <= (0.01 if name == "vtk" else 0)
    assert rms(images[0] - images[1]) > 0.05 and rms(images[1] - images[2]) > 0.05


@both
def test_the_overview_of_opacities_leaves_hidden_voxels_out(volume, how):
    given = without_half(volume, how)
    found = overview_of(*given, MODES.sample(RANGE)[None]).opacity[0]
    expected = drawn(RaycastRenderer, *given, OVERVIEW_SIZE)[..., 3].mean()
    assert found == pytest.approx(expected, abs=0.01)


@renderers
def test_a_mask_of_another_grid_is_refused(volume, name):
    other = Mask.of(np.eye(EDGE, dtype=bool)[None].repeat(3, axis=0))
    with pytest.raises(TfscopeError, match="the mask has 24 × 24 × 3 voxels"):
        drawn(opened(name), volume, inputs(other), SIZE)


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


def test_filled_voxels_are_means_of_their_neighbors(monkeypatch):
    monkeypatch.setattr(filling, "PART", 50)
    random = np.random.default_rng(1)
    voxels = random.normal(0, 10, (9, 8, 7))
    missing = random.random(voxels.shape) < 0.2
    missing[:, :, 3:] = True
    result = filling.fill(np.where(missing, -5.0, voxels), missing)
    np.testing.assert_array_equal(result[~missing], voxels[~missing])
    padded = np.pad(np.where(missing, np.nan, voxels), 1, constant_values=np.nan)
    for z, y, x in np.argwhere(missing):
        around = padded[z : z + 3, y : y + 3, x : x + 3]
        if not np.isnan(around).all():
            assert result[z, y, x] == pytest.approx(np.nanmean(around))
    # Two layers are filled, not three.
    assert (result[:, :, 4] != -5.0).all() and (result[:, :, 5:] == -5.0).all()
