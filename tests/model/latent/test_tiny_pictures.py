import numpy as np
import pytest
from drawing import RANGE, WHITE

from model.latent.tiny_pictures import MOST_EXPOSED, exposures, overview_of
from model.rendering.brightness import brighten
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_opacity_tfs
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.tf_perturbation import with_opacity
from model.scene.transfer_function import GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View


def mode(mean, width, height):
    return OpacityTF(RANGE, (GaussianMode(mean, width, height),)).sample()


def seen(view, crop=None):
    tf = TransferFunction(OpacityTF(RANGE), WHITE)
    return SceneInputs.of(view, tf, crop=crop)


OBLIQUE = View(31, -64, 20, 0.5)


@pytest.mark.parametrize(("view", "crop"), [
    (View(), None), (View(90, 0, 0, 1), None), (OBLIQUE, None),
    (OBLIQUE, CropBox((0.1, 0.0, 0.2), (0.6, 0.9, 1.0))),
])  # fmt: skip
def test_mean_opacities_are_those_of_the_ray_caster(volume, view, crop):
    inputs, tfs = seen(view, crop), draw_opacity_tfs(Scene.of(volume, 16), 0, 0, 20)
    means = overview_of(volume, inputs, tfs, 16, 0.1).opacity
    renderer = RaycastRenderer(volume, sample_distance=0.1)
    for opacities, mean in zip(tfs, means, strict=True):
        expected = renderer.render(with_opacity(inputs, opacities), 16)[..., 3].mean()
        assert mean == pytest.approx(expected, abs=0.005)


def test_empty_and_solid_images_are_found(volume):
    tfs = np.stack([np.zeros(256), np.full(256, 0.9), mode(120, 20, 0.3), np.full(256, 1e-5)])
    overview = overview_of(volume, seen(View()), tfs)
    assert overview.is_empty.tolist() == [True, False, False, True]
    assert overview.is_solid.tolist() == [False, True, False, False]
    assert overview.shows_something.tolist() == [False, False, True, False]
    assert overview.opacity[0] == 0 < overview.opacity[2] < overview.opacity[1]


def test_values_that_are_seen(volume):
    tfs = np.stack([mode(60, 10, 0.3), mode(180, 10, 0.3), np.zeros(256)])
    overview = overview_of(volume, seen(View()), tfs)
    dominant = overview.dominant_values(RANGE)
    assert dominant[:2] == pytest.approx([60, 180], abs=8)
    assert np.isnan(dominant[2])
    assert overview.shares[:2].sum(axis=1) == pytest.approx([1, 1], rel=1e-4)
    assert overview.shares[2].sum() == 0
    assert overview.shows((160.0, 200.0), RANGE).tolist() == [False, True, False]
    broad = overview_of(volume, seen(View()), mode(120, 1.5, 0.5)[None])
    assert broad.shows((120.4, 120.4), RANGE).all()
    assert overview.shows((200.0, 160.0), RANGE).tolist() == [False, True, False]


def test_exposed_pictures_are_as_bright_as_others():
    """Of noise at different levels, by the display curve itself; one is too faint."""
    noise = np.random.default_rng(0).random((1, 400, 3)).astype(np.float32)
    pictures = noise * np.array([0.9, 0.4, 0.2, 0.01], np.float32)[:, None, None]
    factors = exposures(pictures, 2.0)
    assert factors[0] == 2 and factors[3] == 2 * MOST_EXPOSED
    for picture, factor in zip(pictures[1:3], factors[1:3], strict=True):
        brighten(picture, float(factor))
        assert np.quantile(picture.max(axis=1), 0.99) == pytest.approx(0.8, abs=0.01)
    assert exposures(np.zeros((1, 400, 3)), 2.0) == 2
