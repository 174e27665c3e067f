"""Places under a pixel, against the ray caster's depth and its opacity."""

import numpy as np
import pytest
from drawing import RAINBOW
from ramp import make_volume

from model.rendering.ray_places import VISIBLE, most_visible, places_along, ray_places, values_at
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.scene.view import Projection, View
from model.scene.volume import Volume
from tests.reference_raycaster import interpolated

SIZE = 24
OBLIQUE = ClipPlane((-0.3, -1.0, 0.6), 0.1)
PIXELS = (2 * np.arange(SIZE) + 1 - SIZE) / SIZE


def scenes(volume):
    lo, hi = volume.scalar_range
    faint = OpacityTF((lo, hi), (GaussianMode(lo + 0.7 * (hi - lo), 0.1 * (hi - lo), 0.2),))
    box = CropBox((0.3, 0.0, 0.1), (0.9, 0.6, 1.0))
    half = Mask.of(np.indices(volume.voxels.shape)[2] < volume.dimensions[0] // 2)
    for view, part in (
        (View(30.0, 20.0, 10.0, 0.7, 0.1, -0.2), {}),
        # From within the volume, and of a part of it.
        (View(200.0, -40.0, 0.0, 0.15), {}),
        (View(110.0, 5.0, 0.0, 0.8), {"crop": box}),
        (View(30.0, 20.0), {"mask": half}),
        (View(30.0, 20.0, 5.0, 0.8, -0.1, 0.2, is_orthographic=True), {"clip": OBLIQUE}),
    ):
        yield SceneInputs(view, faint, RAINBOW, **part)


@pytest.mark.parametrize("number", range(5))
def test_the_first_place_is_where_the_ray_caster_first_sees_something(volume, number):
    inputs = list(scenes(volume))[number]
    image, depth = RaycastRenderer(volume).frame(inputs, SIZE)
    projection = Projection(inputs.view, volume.proportions)
    seen = 0
    for row, column in np.ndindex(SIZE, SIZE):
        at = PIXELS[column], -PIXELS[row]
        points, weights = places_along(volume, inputs, at)
        assert weights.sum() == pytest.approx(image[row, column, 3], abs=0.01)
        visible = points[np.cumsum(weights) >= VISIBLE]
        if len(visible) == 0 or np.isinf(depth[row, column]):
            assert weights.sum() == pytest.approx(1 / 255, abs=2e-3) or weights.sum() < 1 / 255
            continue
        seen += 1
        away = depth[[row], [column]] / volume.radius
        expected = projection.points(np.array([at]), away)[0]
        difference = (visible[0] - expected) * volume.extent / volume.voxel_size
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


def test_shells_show_from_the_eye_on_with_what_those_in_front_leave():
    # Around the middle, at which the ray aims; values are distances from it.
    offsets = np.meshgrid(*(np.linspace(-1, 1, n) for n in (61, 41, 51)), indexing="ij")
    away = np.sqrt(sum(each**2 for each in offsets)).clip(0, 1).astype(np.float32)
    volume, view, seen = Volume(away, (0.02, 0.025, 1 / 60)), View(35.0, 25.0, 7.0, 0.9), 0.2
    points = [(0.0, 0.0), (0.34, 0.0), (0.35, seen), (0.45, seen), (0.46, 0.0)]
    points += [(0.79, 0.0), (0.8, seen), (0.9, seen), (0.91, 0.0)]
    inputs = SceneInputs(view, OpacityTF((0.0, 1.0), points=tuple(points)), RAINBOW)
    found = ray_places(volume, inputs, (0.0, 0.0))
    back = view.basis()[2] / np.linalg.norm(view.basis()[2])
    shares = []
    for (place, share), radius in zip(found, (0.9, 0.45, -0.35, -0.8), strict=True):
        at = (np.array(place) - 0.5) * 2
        assert at @ back == pytest.approx(radius, abs=0.05)
        np.testing.assert_allclose(at, (at @ back) * back, atol=0.05)
        shares.append(share)
    through = shares[1] / shares[0]
    assert shares == pytest.approx(shares[0] * through ** np.arange(4), abs=0.05)
    assert through < 0.9 and sum(shares) == pytest.approx(1.0, abs=0.01)
    # What shows most: of all values, and of the inner shell's.
    for listed, (place, _) in (((), found[0]), (((2.0, 3.0), (0.35, 0.45)), found[1])):
        point = most_visible(volume, inputs, (0.0, 0.0), listed)
        np.testing.assert_allclose(point, place, atol=0.05)
    assert most_visible(volume, inputs, (0.95, 0.95)) is None
    assert ray_places(volume, inputs, (0.95, 0.95)) == []
    # Where a ray enters, rounding does not leave the volume: sessions would refuse the place.
    opaque = OpacityTF((100.0, 200.0), points=((100.0, 1.0), (200.0, 1.0)))
    inputs = SceneInputs(View(318.0, 46.0, 0.0, 2.1), opaque, RAINBOW)
    ((place, _),) = ray_places(make_volume(), inputs, (-0.3, 0.1))
    assert max(place) == 1
