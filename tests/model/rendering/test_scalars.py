from functools import partial

import numpy as np
import pytest
from drawing import RANGE, VIEW, WHITE, constant, drawn, rms, slab
from scipy.ndimage import map_coordinates

from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.rendering.scalars import BEYOND, blurred, noise_of, renderable_scalars
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.crop import CropBox
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.ranges import robust_range
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from tests.reference_light import picture

NATIVE = (np.uint8, np.int16, np.float32)
UNIT = np.linspace(0, 1, 60).reshape(3, 4, 5)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_native_types_are_not_copied(dtype):
    volume = Volume((100 * UNIT).astype(dtype))
    scalars, scalar_range = renderable_scalars(volume, NATIVE)
    assert np.shares_memory(scalars, volume.voxels)
    assert scalar_range == (0.0, 100.0)


@pytest.mark.parametrize("dtype", ["int8", "uint16", "int32", "uint64", "float16", "float64"])
def test_other_types_become_float32_from_0_to_1(dtype):
    volume = Volume((100 * UNIT).astype(dtype))
    scalars, scalar_range = renderable_scalars(volume, NATIVE)
    assert (scalars.dtype, scalar_range) == (np.float32, (0.0, 1.0))
    lo, hi = volume.scalar_range
    exact = (volume.voxels.astype(np.float64) - lo) / (hi - lo)
    np.testing.assert_allclose(scalars, exact, atol=1e-7)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("scale", [1e-41, 1e-37, 3e38])
def test_extremes_leave_room_for_differences(dtype, scale):
    values = (2 * (UNIT - 0.5) * scale).astype(dtype)
    scalars, (lo, hi) = renderable_scalars(Volume(values), NATIVE)
    with np.errstate(over="raise", invalid="raise", divide="raise"):
        width = np.float32(hi) - np.float32(lo)
        # What renderers compute: the number of table entries per unit, and differences.
        assert np.isfinite(np.float32(256 * 16) / width)
        assert np.isfinite(np.diff(scalars)).all()
        np.testing.assert_allclose((scalars - np.float32(lo)) / width, UNIT, atol=1e-3)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("outlier", [3e38, -1e30])
def test_floats_are_clamped_far_beyond_the_range_only(dtype, outlier):
    voxels = UNIT.astype(dtype)
    voxels[1, 2, 3] = outlier
    chosen = (0.25, 0.5)
    scalars, (lo, hi) = renderable_scalars(Volume(voxels).over(chosen), NATIVE)
    exact = (voxels.astype(float) - 0.25) / 0.25
    shares = (scalars - np.float64(lo)) / (hi - lo)
    np.testing.assert_allclose(shares, exact.clip(-BEYOND, 1 + BEYOND), rtol=1e-6)
    # What lies between the outlier and its neighbours has the digits that a TF's bins need.
    share = np.float32(1e-3)
    between = scalars[1, 2, 2] + share * (scalars[1, 2, 3] - scalars[1, 2, 2])
    expected = float(scalars[1, 2, 2]) * (1 - 1e-3) + 1e-3 * float(scalars[1, 2, 3])
    assert abs(between - expected) / (hi - lo) < 1 / 256 / 16


def test_integers_over_a_range_that_float32_cannot_hold_are_rescaled():
    volume = Volume(np.linspace(0, 60_000, 60).reshape(3, 4, 5).astype(np.uint16))
    narrow = (50_000.3, 50_001.3)
    scalars, scalar_range = renderable_scalars(volume.over(narrow), (np.uint16,))
    assert (scalars.dtype, scalar_range) == (np.float32, (0.0, 1.0))
    scalars, scalar_range = renderable_scalars(volume.over((50_000.0, 50_001.0)), (np.uint16,))
    assert scalars is volume.voxels and scalar_range == (50_000.0, 50_001.0)


@pytest.mark.parametrize("renderer", [RaycastRenderer, VtkRenderer])
@pytest.mark.parametrize(
    ("dtype", "outlier"), [("float32", 3e38), ("float32", -1e30), ("float64", 1e300)]
)
def test_one_outlier_changes_one_voxel(volume, renderer, dtype, outlier):
    voxels = volume.voxels.astype(dtype)
    plain = Volume(voxels, volume.spacing)
    voxels = voxels.copy()
    voxels[tuple(n // 2 for n in voxels.shape)] = outlier
    bad = Volume(voxels, volume.spacing)
    bad = bad.over(robust_range(bad))
    tf, other = (default_transfer_function(each) for each in (plain, bad))
    assert other.opacity.sample() == pytest.approx(tf.opacity.sample(), abs=0.02)
    inputs = SceneInputs.of(View(20, 10), tf)
    images = [drawn(renderer, each, inputs, 48) for each in (plain, bad)]
    assert images[0][..., 3].max() > 0.3
    # As one voxel in the middle: at most a few pixels differ.
    assert (np.abs(images[0] - images[1]).max(axis=-1) > 2 / 255).sum() <= 12
    assert rms(images[0] - images[1]) < 0.01


@pytest.mark.parametrize("scale", [1e-30, 1e30])
def test_light_does_not_depend_on_the_unit_of_float32(scale):
    """Fourth powers of differences must neither vanish nor overflow: dark pictures, or NaN."""
    noisy = UNIT + np.random.default_rng(0).normal(0, 0.01, UNIT.shape)
    images = []
    for factor in (1.0, scale):
        volume = Volume((factor * noisy).astype(np.float32))
        lo, hi = volume.scalar_range
        opacity = OpacityTF((lo, hi), points=((lo, 0.0), (hi, 0.5)))
        inputs = SceneInputs(View(30.0), opacity, ColorTF((lo, hi), ((lo, 1.0, 1.0, 1.0),)))
        images.append(drawn(RaycastRenderer, volume, inputs, 24, "direct"))
    assert images[0][..., :3].max() > 0.1
    np.testing.assert_allclose(images[1], images[0], atol=0.004)


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


@pytest.mark.parametrize("dtype", NATIVE)
def test_blurred_voxels_are_a_cubic_b_spline(dtype):
    voxels = np.random.default_rng(4).integers(0, 255, (3, 4, 5), endpoint=True).astype(dtype)
    places = np.indices(voxels.shape)
    expected = map_coordinates(voxels.astype(float), places, prefilter=False, mode="nearest")
    found = blurred(voxels)
    assert found.dtype == dtype
    np.testing.assert_allclose(found, expected, atol=1e-4 if dtype == np.float32 else 0.501)


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
    away = np.linalg.norm(np.indices((48, 48, 48)) - 23.5, axis=0)
    ball = np.rint(180 * np.clip(18.5 - away, 0, 1)).astype(np.uint8)
    solid = OpacityTF(RANGE, points=((80.0, 0.0), (120.0, 0.95)))
    lower = CropBox((0.0, 0.0, 0.0), (1.0, 1.0, 0.55))
    inputs = SceneInputs(View(), solid, WHITE, crop=lower)
    images = [
        drawn(VtkRenderer, Volume(ball, (unit, unit, 2 * unit)).over(RANGE), inputs, 48, "direct")
        for unit in (1.0, 1e-9, 1e6)
    ]
    for image in images[1:]:
        assert np.abs(image - images[0]).max() <= 2 / 255


PIXELS = 64
KINDS = RaycastRenderer, VtkRenderer
RANGES = [
    (40.0, 60.0), (49.75, 51.0), (-100.0, 45.0), (90.0, 1090.0), (-900.0, 1000.0), (0.0, 100.0),
]  # fmt: skip
"""Narrow, between two voxels, cut off at one end, beyond one end, wide, and the voxels' own."""


def rising(dtype="float32", count=11):
    """A volume that rises from 0 to 100 along x, in a few steps; linear between them."""
    return Volume(np.broadcast_to(np.linspace(0, 100, count), (12, 14, count)).astype(dtype))


def noise(dtype):
    """Voxels without any relation to their neighbours, from 0 to 100."""
    voxels = np.random.default_rng(5).integers(0, 101, (9, 10, 11))
    voxels[0, 0, :2] = 0, 100
    return Volume(voxels.astype(dtype))


@pytest.mark.parametrize("chosen", RANGES)
@pytest.mark.parametrize(("make", "dtype"), [(rising, "float32"), (noise, "uint8")])
def test_what_lies_between_voxels_is_what_it_is_over_any_range(dtype, chosen, make):
    volume = make(dtype).over(chosen)
    lo, hi = chosen
    middle = (lo + hi) / 2
    # The colour tells the value, and all values show, the ends' the most.
    opacity = OpacityTF(chosen, points=((lo, 0.3), (middle, 0.075), (hi, 0.15)))
    stops = ((lo, 0.0, 0.2, 1.0), (middle, 0.2, 1.0, 0.3), (hi, 1.0, 0.1, 0.0))
    inputs = SceneInputs(VIEW, opacity, ColorTF(chosen, stops))
    # VTK leaves out the last step of each ray, so it is to be a short one.
    expected = picture(volume, inputs, PIXELS, 0.13)
    assert expected[..., 3].max() > 0.3
    ours, vtk = (drawn(kind, volume, inputs, PIXELS, sample_distance=0.13) for kind in KINDS)
    assert np.abs(ours - expected).max() < 1e-3
    assert rms(vtk - expected) < 0.006


@pytest.mark.parametrize("chosen", [(40.0, 60.0), (-900.0, 1000.0)])
def test_a_range_decides_about_tfs_and_not_about_light(chosen):
    # The same TF, once over the voxels' range and once over a chosen one, in 1, 2 or 50 bins.
    volume = rising("float32", 40)
    lo, hi = max(chosen[0], 0.0), min(chosen[1], 100.0)
    opacity = ((chosen[0], 0.1), (lo, 0.1), (hi, 0.3), (chosen[1], 0.3))
    color = ((lo, 0.2, 0.4, 0.9), (hi, 0.9, 0.6, 0.1))
    for kind in KINDS:
        images = []
        for each in (volume, volume.over(chosen)):
            tf = OpacityTF(each.scalar_range, points=tuple(dict(opacity).items()))
            inputs = SceneInputs(VIEW, tf, ColorTF(each.scalar_range, color))
            # From the side: the volume's gradient runs across the view.
            light = LightDirection(-45.0, 45.0)
            images.append(drawn(kind, each, inputs, PIXELS, lighting="direct", light=light))
        assert images[0][..., :3].max() > 0.1
        assert rms(images[0] - images[1]) < 0.006
