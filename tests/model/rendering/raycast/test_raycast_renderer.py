"""The ray caster's images against a second ray caster in float64, and against closed forms."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from drawing import MODES, RAINBOW, RANGE, VIEW, WHITE, constant, drawn, slab

from model.rendering.raycast.batch import CLOSE
from model.rendering.raycast.classification import LARGEST_ERROR
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import smooth_distance
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import (
    TF_SAMPLES,
    ColorTF,
    GaussianMode,
    OpacityTF,
    TransferFunction,
)
from model.scene.view import View
from model.scene.volume import Volume
from tests.reference_light import picture
from tests.reference_raycaster import cast, correct, depth

VIEWS = (
    VIEW, View(200.0, -60.0, -8.0, 0.4), View(10.0, 90.0, 3.0, 0.1), View(77.0, -15.0, 0, 0.02),
)  # fmt: skip
"""From outside, from near by, and from inside the volume."""

TOLERANCE = 2e-3


def waves(shape):
    """A smooth field from 0 to 1 without symmetries."""
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij")
    values = np.exp(-(x**2 + (y - 0.3) ** 2 + z**2) / 0.4) + 0.1 * np.sin(4 * x + 3 * y - 2 * z)
    return (values - values.min()) / np.ptp(values)


def random_tf(rng, scalar_range, highest=0.4):
    values = np.linspace(*scalar_range, 17).tolist()
    opacities = (highest * rng.random(17)).tolist()
    stops = tuple((value, *rng.random(3).tolist()) for value in values)
    points = tuple(zip(values, opacities, strict=True))
    return OpacityTF(scalar_range, points=points), ColorTF(scalar_range, stops)


@pytest.mark.parametrize(
    ("dtype", "low", "high"),
    [
        ("uint8", 0, 255), ("float32", 0.0, 1.0), ("float64", -3.0, 0.5),
        ("float64", 1e9, 1e9 + 1e-3), ("float32", -3e38, 3e38), ("float32", 0.0, 1e-37),
    ],
)  # fmt: skip
def test_images_agree_with_a_ray_caster_in_float64(dtype, low, high):
    share = waves((19, 23, 14))
    values = share * high + (1 - share) * low
    scalars = (np.rint(values) if dtype[0] in "iu" else values).astype(dtype)
    volume = Volume(scalars, (1.5, 0.7, 1.1), (10.0, -3.0, 5.0))
    scalar_range = volume.scalar_range
    opacity_tf, color_tf = random_tf(np.random.default_rng(3), scalar_range)
    opacity = opacity_tf.sample(scalar_range).astype(np.float64)
    renderer = RaycastRenderer(volume, threads=1)
    for view in VIEWS:
        rgba, found = renderer.frame(SceneInputs(view, opacity_tf, color_tf), 24)
        assert rgba.dtype == found.dtype == np.float32
        image = picture(volume, SceneInputs(view, opacity_tf, color_tf), 24, 0.5)
        np.testing.assert_allclose(rgba, image, atol=TOLERANCE)
        expected = depth(cast(volume, view, 24, 0.5), correct(opacity, 0.5))
        np.testing.assert_allclose(found, expected, rtol=1e-5)
        assert image[..., 3].max() > 0.5


@pytest.mark.parametrize("seed", range(6))
def test_any_shape_spacing_step_and_view(seed):
    rng = np.random.default_rng(seed)
    # Two voxels, whole cells of eight, and one voxel more or less.
    shape = (2, 2, 2) if seed == 0 else tuple(rng.choice([2, 3, 8, 9, 10, 16, 17, 18, 25], 3))
    scalars = rng.integers(0, 256, shape).astype(np.uint8)
    scalars[rng.random(shape) > rng.choice([0.02, 0.2, 1.0])] = 0
    scalars.flat[0], scalars.flat[-1] = 0, 255
    volume = Volume(scalars, tuple(np.exp(rng.uniform(-1, 1, 3)).tolist()))
    step = float(rng.choice([0.25, 0.5, 1.0, 4.0]))
    opacity_tf, color_tf = random_tf(rng, RANGE)
    elevation, distance = rng.uniform(-90, 90), float(rng.choice([0.01, 0.1, 0.6, 1.0, 2.0]))
    view = View(rng.uniform(0, 360), elevation, rng.uniform(-20, 20), distance)
    inputs = SceneInputs(view, opacity_tf, color_tf)
    image = RaycastRenderer(volume, sample_distance=step).render(inputs, 16)
    # Noise has steep slopes: the 16 table entries of a bin show.
    expected = picture(volume, inputs, 16, step)
    np.testing.assert_allclose(image, expected, atol=15e-3)
    assert np.abs(image - expected).mean() < 5e-4


@pytest.mark.parametrize("seed", range(3))
def test_skipping_and_termination_change_less_than_half_a_step_of_8_bits(seed):
    rng = np.random.default_rng(seed)
    scalars = np.zeros((42, 35, 50), np.uint8)
    # Grains of all sizes, most cells empty.
    for _ in range(12):
        corner, size = rng.integers(0, 40, 3), rng.integers(1, 9, 3)
        block = tuple(slice(c, c + s) for c, s in zip(corner, size, strict=True))
        scalars[block] = rng.integers(1, 256)
    scalars[20, 17, 25] = 255
    volume = Volume(scalars, (1.0, 0.8, 1.3))
    first = float(rng.choice([0.0, 1e-6, 3e-4]))
    points = ((0.0, first), (40.0, first), (41.0, 0.02), (200.0, 0.9), (255.0, 1.0))
    opacity_tf = OpacityTF(RANGE, points=points)
    renderer = RaycastRenderer(volume)
    for distance in (0.05, 0.4, 1.0):
        view = View(rng.uniform(0, 360), rng.uniform(-90, 90), 5.0, distance)
        renderer.skip_empty = renderer.terminate_early = True
        fast, fast_depth = renderer.frame(SceneInputs(view, opacity_tf, RAINBOW), 32)
        renderer.skip_empty = renderer.terminate_early = False
        whole, whole_depth = renderer.frame(SceneInputs(view, opacity_tf, RAINBOW), 32)
        assert np.abs(fast - whole).max() < LARGEST_ERROR
        # A pixel may pass the threshold of visibility a sample earlier or later.
        assert (fast_depth == whole_depth).mean() > 0.99


@pytest.mark.parametrize("opacity", [1e-6, 0.02, 0.2, 0.6])
@pytest.mark.parametrize("step", [0.25, 0.5, 1.0, 2.0])
def test_a_homogeneous_slab_absorbs_exponentially(opacity, step):
    renderer = RaycastRenderer(slab(), sample_distance=step)
    renderer.skip_empty = renderer.terminate_early = False
    # The central ray of an image of odd size goes straight through 8 voxels.
    alpha = renderer.render(SceneInputs(View(), constant(opacity), WHITE), 33)[16, 16, 3]
    exact = -np.expm1(8 * np.log1p(-opacity))
    assert alpha == pytest.approx(exact, rel=1e-5, abs=1e-9)


@pytest.mark.parametrize("lighting", ["none", "direct", "soft"])
def test_images_do_not_depend_on_threads_nor_on_what_was_rendered_before(volume, lighting):
    inputs = SceneInputs(VIEW, MODES, RAINBOW)
    image = drawn(RaycastRenderer, volume, inputs, 40, lighting, threads=1)
    three = RaycastRenderer(volume, lighting, threads=3)
    for view, opacity_tf in ((VIEWS[1], constant(0.4)), (VIEW, constant(0.4)), (VIEWS[1], MODES)):
        three.render(SceneInputs(view, opacity_tf, WHITE), 32)
    np.testing.assert_array_equal(three.render(inputs, 40), image)


def test_where_a_value_is_visible_adds_up_to_the_opacity():
    renderer = RaycastRenderer(Volume(np.rint(255 * waves((19, 23, 14))).astype(np.uint8)))
    inputs = SceneInputs.of(VIEW, TransferFunction(MODES, RAINBOW))
    opacity = renderer.render(inputs, 24)[..., 3]
    bins = np.arange(TF_SAMPLES)
    parts = [
        renderer.value_visibility(inputs, 24, ((bins >= low) & (bins < high)).astype(float))
        for low, high in ((0, 90), (90, 180), (180, 256))
    ]
    assert all(part.max() > 0.01 for part in parts)
    np.testing.assert_allclose(np.sum(parts, axis=0), opacity, atol=1e-5)
    # Over the whole image it is what the other kernel counts value by value.
    window = np.array([[0, 24, 0, 24]])
    counted = renderer.visibility(inputs, 24, window)
    weights = np.exp(-((bins - 120) ** 2) / 800)
    shown = renderer.value_visibility(inputs, 24, weights)
    assert shown.sum() == pytest.approx(float(weights @ counted), rel=0.02)


UNIT = (0.0, 1.0)
THREE = ColorTF(UNIT, ((0.0, 0.1, 0.2, 0.9), (0.4, 0.9, 0.8, 0.1), (1.0, 1.0, 0.3, 0.2)))
SHEETS = OpacityTF(UNIT, tuple(GaussianMode(at, 0.008, 0.9) for at in (0.25, 0.5, 0.75)))


def off_by(a, b):
    return float(np.sqrt(np.mean((a[..., :3] - b[..., :3]) ** 2)))


@pytest.mark.parametrize("distance", [CLOSE, 0.1, 0.05])
@pytest.mark.parametrize("shape", [(21, 26, 18), (2, 26, 18)])
def test_images_are_nearly_those_of_a_float64_ray_caster_that_reads_at_each_sample(distance, shape):
    volume = Volume(waves(shape).astype(np.float32), (1.2, 0.8, 1.0))
    for view in VIEWS:
        inputs = SceneInputs(view, SHEETS, THREE)
        truth, far = (picture(volume, inputs, 24, apart * distance) for apart in (1, 4))
        found = RaycastRenderer(volume, threads=1).render(inputs, 24, distance)
        assert off_by(found, truth) < 0.35 * off_by(far, truth)
        assert abs(found - truth).mean() < 0.008


@pytest.mark.parametrize("lighting", ["none", "direct", "soft"])
def test_rings_go_under_all_lights(lighting):
    volume = Volume(waves((42, 52, 36)).astype(np.float32))
    renderer = RaycastRenderer(volume, lighting, threads=1)
    inputs = SceneInputs(VIEW, SHEETS, THREE)
    truth = renderer.render(inputs, 48, 1 / 64)
    usual = off_by(renderer.render(inputs, 48), truth)
    assert off_by(renderer.render(inputs, 48, smooth_distance(0.5, lighting)), truth) < 0.3 * usual


PLAIN = """
import sys
from numba.core.dispatcher import Dispatcher
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.view import View
from model.volume_files.shipped import shipped_volumes
from model.volume_files import read_volume
volume = read_volume(shipped_volumes()[0])
inputs = SceneInputs.of(View(30.0, 20.0), default_transfer_function(volume))
RaycastRenderer(volume).render(inputs, 16)
print(*sys.modules)
ours = [module for name, module in list(sys.modules.items()) if name.startswith("model.")]
found = [item for module in ours for item in vars(module).values()]
used = [item.py_func for item in found if isinstance(item, Dispatcher) and item.signatures]
print(*(f"{each.__module__}.{each.__name__}" for each in used))
"""


@pytest.mark.slow
def test_a_plain_picture_loads_and_compiles_nothing_of_what_it_lacks(tmp_path):
    caches = dict.fromkeys(("XDG_CACHE_HOME", "LOCALAPPDATA"), str(tmp_path))
    command, root = [sys.executable, "-c", PLAIN], Path(__file__).parents[4]
    done = subprocess.run(
        command, cwd=root, env={**os.environ, **caches}, capture_output=True, text=True, check=True
    )
    loaded, compiled = done.stdout.splitlines()
    assert "raycast.marching" in loaded and "raycast.batch.fetch" in compiled
    of_others = (
        "vtkmodules torch openvino sklearn PySide6 pyqtgraph PIL h5py zarr pydicom nibabel dask "
        "path_tracing vtk_renderer differentiation tangents sensitivity networks latent training"
    )
    assert not set(of_others.split()) & set(loaded.replace(".", " ").split())
    of_light = "shading", "illumination", "light_sweeps", "path_tracing"
    assert [name for name in of_light if name in compiled] == []
