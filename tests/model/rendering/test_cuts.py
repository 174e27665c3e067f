"""A clipping plane at any angle, and orthographic views: by each renderer, in each light."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from drawing import MODES, RAINBOW, RANGE, drawn, rms

from model.rendering.path_tracing import renderer
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raster import Raster
from model.rendering.ray_places import places_along
from model.rendering.raycast import renderer as raycast
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.renderer import open_renderer
from model.rendering.scale_bar import Scale
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.hints import why_nothing
from model.scene.inputs import SceneInputs, outside_range
from model.scene.mask import Mask
from model.scene.scene import LightDirection, Scene
from model.scene.transfer_function import OpacityTF
from model.scene.view import Projection, View
from model.scene.volume import Volume
from tests import reference_light

SPACING = (1.0, 1.5, 0.7)
LIGHT = LightDirection(-30.0, 30.0)
SOLID = OpacityTF(RANGE, points=((0.0, 0.0), (80.0, 0.0), (120.0, 0.9), (255.0, 0.9)))
PERSPECTIVE = View(35.0, 25.0, 7.0, 0.6, 0.1, -0.05)
NEAR = replace(PERSPECTIVE, distance=0.3, is_orthographic=True)  # its eye would be in the volume
OBLIQUE = ClipPlane((-0.3, -1.0, 0.6), 0.1)
RASTER = Raster(40, 28, 3, 5, 30, 20)


def noisy(shape=(22, 20, 24)):
    z, y, x = np.meshgrid(*[np.linspace(0, 1, n) for n in shape], indexing="ij")
    field = 90 + 70 * np.sin(5 * x + 3 * z) * np.cos(4 * y) + 40 * z
    return Volume(np.clip(field, 0, 255).astype(np.uint8), SPACING).over(RANGE)


def scene(view=PERSPECTIVE, tf=MODES, **others):
    return SceneInputs(view, tf, RAINBOW, LIGHT, **others)


CUTS = [(PERSPECTIVE, OBLIQUE), (NEAR, None), (NEAR, OBLIQUE)]
cuts = pytest.mark.parametrize(("view", "clip"), CUTS)


@pytest.fixture
def sharp_normals(monkeypatch):
    """No blurred normals, which the slow ray caster does not have."""
    for module in (renderer, raycast):
        monkeypatch.setattr(module, "blur_of", lambda *_: 0.0)


@pytest.mark.usefixtures("sharp_normals")
@cuts
@pytest.mark.parametrize("lighting", ["none", "direct", "soft"])
def test_the_ray_caster_draws_what_the_slow_one_draws(view, clip, lighting):
    volume = noisy()
    for tf in (MODES, SOLID):
        inputs = scene(view, tf, clip=clip)
        found = drawn(RaycastRenderer, volume, inputs, RASTER, lighting)
        expected = reference_light.picture(volume, inputs, RASTER, 0.5, lighting)
        assert expected[..., 3].max() > 0.3
        # Where a plane cuts the cells of soft light's grid, shares are no exact volumes.
        tolerance = 0.01 if lighting == "soft" and clip is not None else 4e-3
        np.testing.assert_allclose(found, expected, atol=tolerance)


@cuts
@pytest.mark.parametrize("lighting", ["none", "direct"])
def test_vtk_draws_the_same(view, clip, lighting):
    volume = noisy()
    for tf, raster in ((MODES, Raster(64, 64)), (SOLID, Raster(48, 80, 0, 20, 48, 40))):
        inputs = scene(view, tf, clip=clip)
        ours, vtk = (
            drawn(partial(open_renderer, name), volume, inputs, raster, lighting)
            for name in ("raycast", "vtk")
        )
        assert rms(ours - vtk) < 0.006
        assert np.abs(ours - vtk).max() < 0.15


def face(axis, sign, place, volume):
    """A plane parallel to a face, at a fraction of the volume's length."""
    return ClipPlane.through(np.full(3, place), sign * np.eye(3)[axis], volume.proportions)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [0, 1])
def test_a_plane_along_a_face_is_the_crop_boxs(axis, side):
    volume, place = noisy(), 0.37
    crop = CropBox().with_plane(axis, side, place)
    clip = face(axis, 1 if side else -1, place, volume)
    view = NEAR if side else PERSPECTIVE
    both = scene(view, SOLID, crop=crop), scene(view, SOLID, clip=clip)
    looks = [("raycast", "none", 2e-3), ("raycast", "direct", 2e-3), ("raycast", "soft", 2e-3)]
    for name, lighting, tolerance in (*looks, ("vtk", "direct", 0.02)):
        opens = partial(open_renderer, name)
        one, other = (drawn(opens, volume, inputs, 32, lighting) for inputs in both)
        np.testing.assert_allclose(one, other, atol=tolerance)
    for one, other in zip(*(places_along(volume, each, (0.1, 0.2)) for each in both), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.usefixtures("sharp_normals")
@pytest.mark.parametrize("view", [PERSPECTIVE, NEAR])
def test_path_traced_light_takes_the_plane_as_a_face(view):
    volume = noisy()
    inputs = scene(view, SOLID, clip=face(1, -1, 0.4, volume))
    tracer = PathTracer(volume)
    cropped = scene(view, SOLID, crop=CropBox((0.0, 0.4, 0.0)))
    one, other = (tracer.render(each, 24, samples=16) for each in (inputs, cropped))
    caster = drawn(RaycastRenderer, volume, inputs, 24, sample_distance=0.125)
    np.testing.assert_allclose(one[..., 3], caster[..., 3], atol=1 / 500)
    # The same random numbers meet the same faces, but for rounding.
    assert np.median(np.abs(one - other)) < 1e-5
    assert rms(one - other) < 0.02


def test_places_in_an_orthographic_view_are_those_of_the_central_plane():
    volume = noisy()
    rng = np.random.default_rng(3)
    points = rng.random((50, 3))
    back = NEAR.basis()[2]
    # Onto the plane through the centre, along the line of sight.
    depth = (points - 0.5) * volume.proportions @ back
    flat = points - depth[:, None] * back / np.array(volume.proportions)
    far = replace(PERSPECTIVE, distance=0.9)
    orthographic = Projection(replace(far, is_orthographic=True), volume.proportions)
    expected = Projection(far, volume.proportions).places(flat)
    np.testing.assert_allclose(orthographic.places(points), expected, atol=1e-12)
    away = orthographic.distances(points)
    np.testing.assert_allclose(orthographic.points(expected, away), points, atol=1e-12)
    # Halfway in the image is halfway on a line.
    start, end = points[:2]
    middle = orthographic.places((start + end)[None] / 2)[0]
    assert orthographic.nearest_on((middle[0], middle[1]), start, end) == pytest.approx(0.5)
    near, whole = (Scale.of(volume).span(view) for view in (far, orthographic.view))
    assert near == pytest.approx(whole)


def test_models_know_none_of_them_and_what_cuts_all_away_is_named():
    mask = Mask.of(noisy().voxels > 100)
    said = outside_range(scene(NEAR, clip=OBLIQUE, mask=mask), Scene.of(noisy(), 16))
    assert all(each in said for each in ("an orthographic view", "a clipping plane", "a mask"))
    inputs = scene(PERSPECTIVE, SOLID, clip=replace(OBLIQUE, offset=-1.0))
    assert drawn(RaycastRenderer, noisy(), inputs, 16).max() == 0
    counts, edges = np.ones(256, int), np.linspace(*RANGE, 257)
    for crop, words in ((None, "The clipping"), (CropBox(), "The crop box or clipping")):
        found = why_nothing(replace(inputs, crop=crop), RANGE, counts, edges)
        assert found.text.startswith(f"{words} plane cuts away all")
