"""Samples so close that the volume is read at every fourth one only."""

import numpy as np
import pytest

from model.rendering.raycast.batch import CLOSE
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import smooth_distance
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import TF_SAMPLES, ColorTF, GaussianMode, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from tests.reference_raycaster import render

RANGE = (0.0, 1.0)
RAINBOW = ColorTF(RANGE, ((0.0, 0.1, 0.2, 0.9), (0.4, 0.9, 0.8, 0.1), (1.0, 1.0, 0.3, 0.2)))
SHEETS = OpacityTF(RANGE, tuple(GaussianMode(at, 0.008, 0.9) for at in (0.25, 0.5, 0.75)))
VIEWS = (View(35.0, 25.0, 7.0, 0.9), View(200.0, -60.0, -8.0, 0.4), View(77.0, -15.0, 0.0, 0.02))
"""From outside, from near by, and from inside the volume, where rays are short."""


def waves(shape=(21, 26, 18)):
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in shape), indexing="ij")
    values = np.exp(-(x**2 + (y - 0.3) ** 2 + z**2) / 0.4) + 0.1 * np.sin(4 * x + 3 * y - 2 * z)
    return np.asarray((values - values.min()) / np.ptp(values), dtype=np.float32)


def rmse(a, b):
    return float(np.sqrt(np.mean((a[..., :3] - b[..., :3]) ** 2)))


@pytest.mark.parametrize("distance", [CLOSE, 0.1, 0.05])
@pytest.mark.parametrize("shape", [(21, 26, 18), (2, 26, 18)])
def test_images_are_nearly_those_of_a_float64_ray_caster_that_reads_at_each_sample(distance, shape):
    volume = Volume(waves(shape), (1.2, 0.8, 1.0))
    opacity, color = SHEETS.sample(RANGE), RAINBOW.sample(RANGE)
    for view in VIEWS:
        truth = render(volume, view, opacity, color, 24, distance)
        found = RaycastRenderer(volume, threads=1).render(
            SceneInputs(view, SHEETS, RAINBOW), 24, distance
        )
        far = render(volume, view, opacity, color, 24, 4 * distance)
        assert rmse(found, truth) < 0.35 * rmse(far, truth)
        assert abs(found - truth).mean() < 0.008


def test_depth_and_skipping_agree_with_the_image():
    volume = Volume(waves())
    renderer = RaycastRenderer(volume, threads=1, sample_distance=0.1)
    inputs = SceneInputs(VIEWS[0], SHEETS, RAINBOW)
    rgba, depth = renderer.frame(inputs, 24)
    np.testing.assert_array_equal(rgba, renderer.render(inputs, 24))
    _, usual = RaycastRenderer(volume, threads=1).frame(inputs, 24)
    seen = np.isfinite(depth) & np.isfinite(usual)
    assert abs(depth[seen] - usual[seen]).max() < 0.6
    renderer.skip_empty = renderer.terminate_early = False
    np.testing.assert_allclose(renderer.render(inputs, 24), rgba, atol=1 / 510)


@pytest.mark.parametrize("lighting", ["none", "direct", "soft"])
def test_rings_go_under_all_lights(lighting):
    volume = Volume(waves((42, 52, 36)))
    renderer = RaycastRenderer(volume, lighting, threads=1)
    inputs = SceneInputs(VIEWS[0], SHEETS, RAINBOW)
    truth = renderer.render(inputs, 48, 1 / 64)
    usual = rmse(renderer.render(inputs, 48), truth)
    assert rmse(renderer.render(inputs, 48, smooth_distance(0.5, lighting)), truth) < 0.3 * usual


def test_images_of_close_samples_do_not_jump():
    renderer = RaycastRenderer(Volume(waves()), threads=1)
    width = 1 / (TF_SAMPLES - 1)
    images = []
    for part in np.linspace(0, 1, 41):
        mode = GaussianMode(0.4 + part * width, 0.02, 0.6)
        inputs = SceneInputs(VIEWS[0], OpacityTF(RANGE, (mode,)), RAINBOW)
        images.append(renderer.render(inputs, 24, 0.1)[..., :3])
    second = np.diff(np.array(images, dtype=np.float64), 2, axis=0)
    assert 0 < abs(second).max() < 0.5 / 255
