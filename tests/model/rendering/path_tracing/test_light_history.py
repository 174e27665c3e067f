"""Light that is found again as the view turns, against the same places seen from the other side."""

from dataclasses import replace

import numpy as np
import pytest

from model.rendering.path_tracing.moving_light import MOST, LightHistory
from model.rendering.raster import Raster
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

SIZE = 48


@pytest.fixture(scope="module")
def block():
    """An opaque block in which each place has another value, longer along one axis."""
    z, y, x = np.mgrid[-1:1:40j, -1:1:32j, -1:1:24j]
    values = 120 + 40 * np.sin(3 * x + y) + 40 * np.sin(3 * y - z)
    return Volume(values.astype(np.float32), (1.2, 0.9, 0.8))


def inputs_from(azimuth, volume):
    low, high = volume.scalar_range
    opacity = OpacityTF((low, high), points=((low, 1.0), (high, 1.0)))
    color = ColorTF((low, high), ((low, 0.0, 0.0, 0.0), (high, 1.0, 1.0, 1.0)))
    return SceneInputs(View(azimuth, 15.0, 5.0, 0.9, 0.1, -0.05), opacity, color)


def looks(volume, inputs):
    renderer = RaycastRenderer(volume)
    rgba, depth = renderer.frame(inputs, SIZE)
    renderer.close()
    return rgba[..., :3], depth


def test_places_are_found_where_they_were_seen_before(block):
    first, turned = inputs_from(30.0, block), inputs_from(36.0, block)
    before, depth = looks(block, first)
    now, depth_now = looks(block, turned)
    raster, history = Raster(SIZE, SIZE), LightHistory(block)
    # The colours themselves, which belong to places, take the part of light.
    history.averaged(first, raster, before, depth)
    mean = history.averaged(turned, raster, now, depth_now)
    found = 2 * mean - now
    # Away from the silhouette, where a pixel has places of several depths.
    inner = np.isfinite(depth_now)
    for axis in (0, 1):
        inner &= np.roll(inner, 2, axis) & np.roll(inner, -2, axis)
    known = inner & np.any(mean != now, axis=2)
    assert known.sum() > 0.7 * inner.sum()
    gap = np.abs(found - now)[known].mean()
    assert gap < 0.006
    # What would be taken from the same pixels is another place's.
    assert np.abs(before - now)[known].mean() > 10 * gap


def test_noise_becomes_less_and_an_edit_begins_anew(block):
    inputs, raster, history = inputs_from(30.0, block), Raster(SIZE, SIZE), LightHistory(block)
    depth = np.full((SIZE, SIZE), block.radius, dtype=np.float32)
    rng = np.random.default_rng(5)

    def noise():
        return 1 + rng.standard_normal((SIZE, SIZE, 3)).astype(np.float32)

    spreads = [history.averaged(inputs, raster, noise(), depth).std() for _ in range(40)]
    # The mean of two, and what an exponential one tends to.
    assert spreads[1] == pytest.approx(2**-0.5, rel=0.05)
    assert spreads[-1] == pytest.approx((1 / (2 * MOST - 1)) ** 0.5, rel=0.1)
    low, high = block.scalar_range
    edited = replace(inputs, opacity_tf=OpacityTF((low, high), points=((low, 0.0), (high, 0.5))))
    assert history.averaged(edited, raster, noise(), depth).std() == pytest.approx(1, rel=0.05)
