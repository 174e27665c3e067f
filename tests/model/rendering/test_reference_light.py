"""The float64 reference of renderers, against closed forms and its own differences."""

import math

import numpy as np
import pytest

from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume
from tests import reference_light
from tests.benchmarks.extremes import VIEW, field, picture, posed

WHITE = ColorTF((0.0, 1.0), ((0.0, 1.0, 1.0, 1.0),))


def constant(opacity):
    return OpacityTF((0.0, 1.0), points=((0.0, opacity),))


@pytest.mark.parametrize("opacity", [1e-12, 1e-3, 0.4, 1 - 1e-7])
def test_the_reference_has_the_opacity_of_a_slab(opacity):
    """Along an axis a ray crosses 19 voxels: 1 - (1 - a)^19, whatever the step is."""
    inputs = SceneInputs(View(), constant(opacity), WHITE)
    for distance in (0.3, 0.5, 1.0):
        image = reference_light.picture(Volume(field()), inputs, 1, distance)
        exact = -math.expm1(19 * math.log1p(-float(np.float32(opacity))))
        assert image[0, 0, 3] == pytest.approx(exact, rel=1e-12)


def test_the_references_derivative_is_that_of_a_slab():
    """All bins together, by the opacity a: 19 (1 - a)^18."""
    inputs = SceneInputs(View(), constant(0.1), WHITE)
    volume, edit = Volume(field()), np.ones(256)
    _, change = reference_light.derivative(volume, inputs, 1, 0.5, "none", edit)
    assert change[0, 0, 3] == pytest.approx(19 * (1 - float(np.float32(0.1))) ** 18, rel=1e-9)


@pytest.mark.parametrize("lighting", ["none", "direct", "soft"])
def test_the_references_derivative_is_the_difference_of_its_pictures(lighting):
    scene = posed()
    edit = np.exp(-0.5 * ((np.arange(256) - 150) / 15) ** 2)
    opacity = scene.inputs.opacity_tf.sample().astype(np.float64)
    more, less = (
        reference_light.picture(
            scene.volume, scene.inputs, 12, 0.5, lighting, opacity=opacity + step * edit
        )
        for step in (1e-6, -1e-6)
    )
    _, change = reference_light.derivative(scene.volume, scene.inputs, 12, 0.5, lighting, edit)
    np.testing.assert_allclose(change, (more - less) / 2e-6, atol=1e-5 * abs(change).max())


def test_what_is_homogeneous_is_half_lit_inside_and_by_its_faces_outside():
    """A headlight on an opaque slab: the face in front has all of the diffuse light and gloss."""
    scalars = np.full((9, 9, 9), 0.5, np.float32)
    scalars[0, 0, 0], scalars[-1, -1, -1] = 0, 1
    for light, exact in (((0.0, 0.0), 1.0), ((60.0, 0.0), 0.45)):
        inputs = SceneInputs(View(), constant(1.0), WHITE, LightDirection(*light))
        image = reference_light.picture(Volume(scalars), inputs, 1, 0.25, "direct")
        assert image[0, 0, 0] == pytest.approx(exact, abs=0.01)


@pytest.mark.parametrize("lighting", ["direct", "soft"])
@pytest.mark.parametrize("opacity", [1e-12, 1e-3])
def test_a_faint_picture_is_lit_as_a_bright_one(lighting, opacity):
    assert picture(lighting, posed(curve=((0.0, opacity),), view=VIEW)) < 0.003
