"""The ray caster against VTK's, which is the reference: same views, same TFs, same step."""

import numpy as np
import pytest
from drawing import RAINBOW, drawn

from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection, Scene
from model.scene.transfer_function import OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

SIZE = 128


@pytest.fixture(scope="module", params=shipped_volumes(), ids=lambda path: path.name[:12])
def shipped(request):
    path = request.param
    return read_volume(path)


@pytest.fixture(scope="module")
def samples(shipped):
    scene = Scene.of(shipped, SIZE)
    return [draw_sample(scene, 11, "train", index) for index in range(3)]


def errors(volume, samples, **options):
    """Root mean square difference of each image between the two renderers."""
    ours, vtk = RaycastRenderer(volume, **options), VtkRenderer(volume, **options)
    found = []
    for sample in samples:
        expected = vtk.render(sample, SIZE)
        assert expected[..., 3].max() > 0.1
        found.append(np.sqrt(np.mean((ours.render(sample, SIZE) - expected) ** 2)))
    ours.close()
    vtk.close()
    return np.array(found)


def test_unlit_images_agree(shipped, samples):
    assert errors(shipped, samples).max() <= 0.005


@pytest.mark.parametrize(("azimuth", "elevation"), [(-45, 45), (150, 30)])
def test_gradient_shading_agrees(shipped, samples, azimuth, elevation):
    light = LightDirection(azimuth, elevation)
    assert errors(shipped, samples[:1], lighting="direct", light=light).max() <= 0.01


@pytest.mark.parametrize("shape", [(2, 2, 2), (2, 5, 3), (40, 30, 2), (30, 30, 30)])
def test_an_opaque_volume_covers_what_vtk_covers(shape):
    scalars = np.full(shape, 200, np.uint8)
    scalars[0, 0, 0] = 0
    opaque = OpacityTF((0.0, 200.0), points=((0.0, 1.0), (200.0, 1.0)))
    # From outside, from a pole with roll, and from near by.
    views = (35.0, 25.0, 7.0, 0.9), (0.0, 80.0), (20.0, 90.0, 15.0), (130.0, -5.0, 0.0, 0.7)
    for view in views:
        inputs = SceneInputs(View(*view), opaque, RAINBOW)
        ours, theirs = (
            drawn(kind, Volume(scalars), inputs, SIZE)[..., 3]
            for kind in (RaycastRenderer, VtkRenderer)
        )
        assert np.isin(ours, (0.0, 1.0)).all()
        assert ours.mean() == pytest.approx(theirs.mean(), rel=0.01)
        assert ((ours > 0.5) != (theirs > 0.5)).sum() <= 8
