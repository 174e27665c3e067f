import numpy as np
import pytest
from drawing import drawn, rms

from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.scalars import BEYOND, renderable_scalars
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.ranges import robust_range
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

NATIVE = (np.uint8, np.int16, np.float32)
UNIT = np.linspace(0, 1, 60).reshape(3, 4, 5)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32])
def test_native_types_are_not_copied(dtype):
    volume = Volume((100 * UNIT).astype(dtype))
    scalars, scalar_range = renderable_scalars(volume, NATIVE)
    assert np.shares_memory(scalars, volume.scalars)
    assert scalar_range == (0.0, 100.0)


@pytest.mark.parametrize("dtype", ["int8", "uint16", "int32", "uint64", "float16", "float64"])
def test_other_types_become_float32_from_0_to_1(dtype):
    volume = Volume((100 * UNIT).astype(dtype))
    scalars, scalar_range = renderable_scalars(volume, NATIVE)
    assert (scalars.dtype, scalar_range) == (np.float32, (0.0, 1.0))
    lo, hi = volume.scalar_range
    exact = (volume.scalars.astype(np.float64) - lo) / (hi - lo)
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
    np.testing.assert_allclose(
        (scalars - np.float64(lo)) / (hi - lo), exact.clip(-BEYOND, 1 + BEYOND), rtol=1e-6
    )
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
