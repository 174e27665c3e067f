import math
from dataclasses import replace

import numpy as np
import pytest

from model.rendering.path_tracing.renderer import Lamp, PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import FileFacts, Volume
from tests import reference_light

SIZE = 96
VIEW = View(30.0, 20.0, 5.0, 0.8)
COUNT = 6
RANGE = (0.0, 5.1)
"""Each label lies on the 50th bin after the one before."""
COLORS = np.array([[0, 0, 0], [0.9, 0.2, 0.1], [0.2, 0.8, 0.3], [0.2, 0.3, 0.9],
                   [0.9, 0.8, 0.2], [0.8, 0.3, 0.8]])  # fmt: skip


def labels(type_=np.uint8):
    """Balls of five labels in one another's way, in a volume of oblong voxels."""
    z, y, x = np.mgrid[:30, :34, :32] / 32
    rng = np.random.default_rng(3)
    values = np.zeros(x.shape, type_)
    for label in range(1, COUNT):
        center = 0.2 + 0.6 * rng.random(3)
        square = (x - center[0]) ** 2 + (y - center[1]) ** 2 + (z - center[2]) ** 2
        values[square < 0.04] = label
    return Volume(values, (1.0, 0.8, 1.3), file=FileFacts(is_labels=True)).over(RANGE)


def tf_of(opacities):
    points = tuple((float(n), float(a)) for n, a in enumerate(opacities))
    stops = tuple((float(n), *map(float, c)) for n, c in enumerate(COLORS))
    return TransferFunction(OpacityTF(RANGE, points=points), ColorTF(RANGE, stops))


OPAQUE, CLEAR = tf_of([0, 1, 1, 1, 1, 1]), tf_of([0, 0.2, 0.05, 0.4, 0.1, 0.02])


@pytest.mark.parametrize("step", [0.5, 0.1])
@pytest.mark.parametrize("type_", [np.uint8, np.int16, np.float32])
def test_every_pixel_of_opaque_labels_has_the_color_of_one(type_, step):
    """Also of samples so close that other volumes are not read at each of them."""
    image = RaycastRenderer(labels(type_)).render(SceneInputs.of(VIEW, OPAQUE), SIZE, step)
    assert np.isin(image[..., 3], (0.0, 1.0)).all()
    away = abs(image[..., None, :3] - COLORS.astype(np.float32)).max(axis=-1)
    assert away.min(axis=-1).max() < 1e-6
    assert len(np.unique(away.argmin(axis=-1))) > 3


def test_every_path_begins_at_the_color_of_one_label():
    """Without gloss, light has the hue of the label it comes from."""
    tracer = PathTracer(labels(), lamp=Lamp(gloss=0.0))
    image = tracer.render(SceneInputs.of(VIEW, OPAQUE), SIZE, samples=4)
    seen = image[image[..., :3].max(axis=-1) > 0.1][:, :3]
    assert len(seen) > 1000
    hues = COLORS[1:] / np.linalg.norm(COLORS[1:], axis=1, keepdims=True)
    cosines = seen @ hues.T / np.linalg.norm(seen, axis=1, keepdims=True)
    # The brightest pixels are cut off at 1.
    assert cosines[seen.max(axis=-1) < 1].max(axis=1).min() > 1 - 1e-5


@pytest.mark.parametrize("tf", [OPAQUE, CLEAR])
@pytest.mark.parametrize("lighting", ["none", "direct"])
def test_images_are_those_of_vtk(lighting, tf):
    images = []
    for kind in (RaycastRenderer, VtkRenderer):
        renderer = kind(labels(), lighting, LightDirection(-30.0, 40.0))
        inputs = SceneInputs.of(VIEW, tf)
        smooth = renderer.render(replace(inputs, interpolates=True), SIZE)
        images.append(renderer.render(inputs, SIZE))
        assert np.sqrt(np.mean((images[-1] - smooth) ** 2)) > 0.01
    assert np.sqrt(np.mean((images[0] - images[1]) ** 2)) < 0.003


@pytest.mark.parametrize("lighting", ["none", "direct", "soft"])
def test_images_are_those_of_the_reference_in_64_bits(lighting):
    volume, inputs = labels(), SceneInputs.of(VIEW, CLEAR, light=LightDirection(-30.0, 40.0))
    found = RaycastRenderer(volume, lighting).render(inputs, 32)
    expected = reference_light.picture(volume, inputs, 32, 0.5, lighting)
    assert math.sqrt(np.mean((found - expected) ** 2)) < 0.001


def test_what_is_visible_is_so_by_label():
    """Every sample lies on a label's bin: the values in between have none of the picture."""
    renderer = RaycastRenderer(labels())
    inputs = SceneInputs.of(VIEW, CLEAR)
    whole = np.array([[0, SIZE, 0, SIZE]])
    visible = renderer.visibility(inputs, SIZE, whole)
    assert np.flatnonzero(visible > 1e-9).tolist() == [50, 100, 150, 200, 250]
    assert visible.sum() == pytest.approx(renderer.render(inputs, SIZE)[..., 3].sum(), rel=1e-3)


def test_other_volumes_are_drawn_so_where_that_is_chosen():
    volume = replace(labels(), file=FileFacts()).over(RANGE)
    renderer, vtk = RaycastRenderer(volume), VtkRenderer(volume)
    inputs = SceneInputs.of(VIEW, OPAQUE)
    chosen = replace(inputs, interpolates=False)
    for each in (renderer, vtk):
        assert abs(each.render(chosen, SIZE) - each.render(inputs, SIZE)).max() > 0.1
    declared = RaycastRenderer(labels())
    np.testing.assert_array_equal(renderer.render(chosen, SIZE), declared.render(inputs, SIZE))
