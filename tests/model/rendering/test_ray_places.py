"""Places under a pixel, against the ray caster's depth and its opacity."""

from dataclasses import replace

import numpy as np
import pytest
from drawing import RAINBOW

from model.rendering.ray_places import first_place, places_along, ray_places, values_at
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import Projection, View
from model.scene.volume import Volume
from tests.reference_raycaster import interpolated

SIZE = 24
PIXELS = (2 * np.arange(SIZE) + 1 - SIZE) / SIZE


def scenes(volume):
    lo, hi = volume.scalar_range
    faint = OpacityTF((lo, hi), (GaussianMode(lo + 0.7 * (hi - lo), 0.1 * (hi - lo), 0.2),))
    yield SceneInputs(View(30.0, 20.0, 10.0, 0.7, 0.1, -0.2), faint, RAINBOW)
    # From within the volume, and of a part of it.
    yield SceneInputs(View(200.0, -40.0, 0.0, 0.15), faint, RAINBOW)
    box = CropBox((0.3, 0.0, 0.1), (0.9, 0.6, 1.0))
    yield SceneInputs(View(110.0, 5.0, 0.0, 0.8), faint, RAINBOW, crop=box)
    shown = np.random.default_rng(2).random(volume.voxels.shape) < 0.8
    yield SceneInputs(View(30.0, 20.0), faint, RAINBOW, mask=Mask.of(shown))


@pytest.mark.parametrize("number", range(4))
def test_the_first_place_is_where_the_ray_caster_first_sees_something(volume, number):
    inputs = list(scenes(volume))[number]
    image, depth = RaycastRenderer(volume).frame(inputs, SIZE)
    projection = Projection(inputs.view, volume.proportions)
    seen = 0
    for row, column in np.ndindex(SIZE, SIZE):
        at = PIXELS[column], -PIXELS[row]
        points, weights = places_along(volume, inputs, at)
        assert weights.sum() == pytest.approx(image[row, column, 3], abs=0.01)
        place = first_place(volume, inputs, at)
        if place is None or np.isinf(depth[row, column]):
            assert weights.sum() == pytest.approx(1 / 255, abs=2e-3) or weights.sum() < 1 / 255
            continue
        seen += 1
        away = depth[[row], [column]] / volume.radius
        expected = projection.points(np.array([at]), away)[0]
        difference = (place - expected) * volume.extent / volume.voxel_size
        assert np.linalg.norm(difference) < 1.01
        np.testing.assert_allclose(projection.places(points[:1])[0], at, atol=1e-9)
        np.testing.assert_allclose(projection.distances(expected[None]), away, rtol=1e-6)
    assert seen > 20


def test_values_between_voxels_and_where_none_is():
    rng = np.random.default_rng(5)
    scalars = rng.normal(size=(4, 5, 6)).astype(np.float32)
    missing = np.zeros(scalars.shape, bool)
    missing[1, 2, 3] = True
    volume = Volume(np.where(missing, np.float32(1e6), scalars), missing=missing)
    points = rng.random((400, 3))
    places = points * (np.array(volume.dimensions) - 1)
    values = values_at(volume, points)
    nearest = (np.rint(places) == (3, 2, 1)).all(axis=1)
    np.testing.assert_array_equal(np.isnan(values), nearest)
    apart = (np.abs(places - (3, 2, 1)) >= 1).any(axis=1)
    expected = interpolated(scalars.astype(float), places)
    np.testing.assert_allclose(values[apart], expected[apart], atol=1e-6)
    assert np.isin(values_at(volume, points[~nearest], is_nearest=True), scalars).all()


UNIT = (0.0, 1.0)
ASIDE = View(35.0, 25.0, 7.0, 0.9, 0.1, -0.05)


def distances(shape=(61, 41, 51), spacing=(1.0, 1.3, 0.8)):
    """A volume of each voxel's distance from the middle, by the volume's smallest half side."""
    z, y, x = (np.arange(n) - (n - 1) / 2 for n in shape)
    offsets = np.meshgrid(z * spacing[2], y * spacing[1], x * spacing[0], indexing="ij")
    away = np.sqrt(sum(each**2 for each in offsets))
    half = min((n - 1) / 2 * step for n, step in zip(shape, spacing[::-1], strict=True))
    return Volume(np.clip(away / half, 0, 1).astype(np.float32), spacing), half


def inputs_of(*shells, opacity=1.0, **others):
    """Spherical shells that are visible, from an inner to an outer radius."""
    points = [(0.0, 0.0)]
    for inner, outer in sorted(shells):
        points += [(inner - 1e-3, 0.0), (inner, opacity), (outer, opacity), (outer + 1e-3, 0.0)]
    tf = OpacityTF(UNIT, points=tuple(points))
    return SceneInputs(ASIDE, tf, ColorTF(UNIT, ((0.0, 1.0, 1.0, 1.0),)), **others)


def met(volume, half, radius, place):
    """Where a ray meets a sphere, in the volume's units from the middle, from the eye on."""
    projection, lengths = Projection(ASIDE, volume.proportions), np.array(volume.extent)
    eye = (projection.eye - 0.5) * lengths
    right, up, back = ASIDE.basis()
    x, y = place[0] - ASIDE.pan_x, place[1] - ASIDE.pan_y
    ray = ASIDE.tangent * (x * right + y * up) - back
    ray /= np.linalg.norm(ray)
    along = -(eye @ ray)
    chord = np.sqrt((radius * half) ** 2 - (eye @ eye - along**2))
    return [eye + (along + sign * chord) * ray for sign in (-1, 1)]


def offset(volume, found):
    return (np.array(found) - 0.5) * volume.extent


@pytest.mark.parametrize("place", [(0.1, -0.05), (0.3, 0.1), (-0.1, 0.2)])
def test_the_first_place_is_on_an_opaque_surface(place):
    volume, half = distances()
    ((found, share),) = ray_places(volume, inputs_of((0.5, 0.8)), place)
    near, _ = met(volume, half, 0.8, place)
    assert np.linalg.norm(offset(volume, found) - near) < volume.voxel_size
    assert share == pytest.approx(1, abs=1e-6)


def test_places_follow_one_another_from_the_eye_on_with_the_shares_that_remain():
    volume, half = distances()
    place = 0.1, -0.05
    found = ray_places(volume, inputs_of((0.35, 0.45), (0.8, 0.9), opacity=0.1), place)
    wanted = [
        met(volume, half, r, place)[side] for r, side in ((0.9, 0), (0.45, 0), (0.35, 1), (0.8, 1))
    ]
    assert len(found) == 4
    for (one, _), at in zip(found, wanted, strict=True):
        assert np.linalg.norm(offset(volume, one) - at) < 1.5 * volume.voxel_size
    # A shell is a tenth of the half side thick; what is behind gets what is left.
    thick = 0.1 * half / volume.voxel_size
    seen = 1 - 0.9**thick
    shares = [seen * (1 - seen) ** number for number in range(4)]
    assert [share for _, share in found] == pytest.approx(shares, rel=0.25)


def test_what_is_cropped_or_hidden_does_not_show():
    volume, half = distances()
    place = 0.1, -0.05
    inputs = inputs_of((0.5, 0.8))
    _, far = met(volume, half, 0.5, place)
    cropped = replace(inputs, crop=CropBox((0.0, 0.5, 0.0), (1.0, 1.0, 1.0)))
    ((found, _),) = ray_places(volume, cropped, place)
    assert found[1] >= 0.5
    assert np.linalg.norm(offset(volume, found) - far) < 1.5 * volume.voxel_size
    front = np.zeros(volume.voxels.shape, bool)
    front[:, : volume.voxels.shape[1] // 2] = True
    ((hidden, _),) = ray_places(replace(volume, missing=front), inputs, place)
    assert np.linalg.norm(offset(volume, hidden) - far) < 1.5 * volume.voxel_size


@pytest.mark.parametrize("place", [(3.0, 0.0), (0.9, 0.9)])
def test_next_to_what_shows_there_is_no_place(place):
    assert ray_places(distances()[0], inputs_of((0.1, 0.3)), place) == []
