"""Images of a volume on a logarithmic scale, against those of its logarithm as a volume."""

from dataclasses import replace

import numpy as np
import pytest
from drawing import VIEW, drawn

from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.volume import Volume

SIZE = 48


@pytest.mark.parametrize("kind", [RaycastRenderer, VtkRenderer])
def test_the_image_is_that_of_the_natural_logarithm(kind):
    values = np.exp(2.0 * np.random.default_rng(4).normal(size=(12, 13, 14)))
    volume = Volume(values).on_scale("log")
    lo, hi = volume.scalar_range
    opacity = OpacityTF((lo, hi), (GaussianMode(0.4, 0.3, 0.4),), scale="log")
    color = ColorTF((lo, hi), ((lo, 0.0, 0.2, 1.0), (hi, 1.0, 0.3, 0.0)))
    found = drawn(kind, volume, SceneInputs(VIEW, opacity, color), SIZE, "direct")
    # The same picture in nepers: everything is ln 10 times as large.
    by = np.log(10.0)
    plain = Volume(np.log(values))
    ends = plain.scalar_range
    nepers = replace(
        opacity, scalar_range=ends, modes=(GaussianMode(0.4 * by, 0.3 * by, 0.4),), scale="linear"
    )
    colors = ColorTF(ends, ((ends[0], 0.0, 0.2, 1.0), (ends[1], 1.0, 0.3, 0.0)))
    expected = drawn(kind, plain, SceneInputs(VIEW, nepers, colors), SIZE, "direct")
    assert expected[..., 3].max() > 0.3
    assert np.abs(found - expected).max() < 2e-3
