"""The projection, against the rays of the renderer's own camera."""

import itertools
from itertools import pairwise

import numpy as np
import pytest

from model.rendering.raycast.rays import camera_array
from model.scene.orientation import turntable
from model.scene.view import AXES, NEAREST_DEPTH, Projection, View, axis_direction
from model.scene.volume import Volume

VOLUME = Volume(np.arange(6 * 5 * 4, dtype=np.float32).reshape(6, 5, 4), spacing=(1.0, 2.0, 0.5))
VIEWS = [
    View(0.0, 0.0),
    View(30.0, 15.0, 40.0, 0.6, 0.3, -0.2),
    View(200.0, -70.0, -5.0, 1.4, -1.0, 0.1),
    View(10.0, 90.0, 0.0, 0.8),
]
CORNERS = np.array(list(itertools.product((0.0, 1.0), repeat=3)))


def place_by_ray(camera, voxel):
    """Place of the ray that meets a voxel."""
    eye, forward, right, up = camera[:12].reshape(4, 3)
    depth, x, y = np.linalg.solve(np.stack([forward, right, up], axis=1), voxel - eye)
    # A ray's direction is that of its place in the image, moved by the camera's offsets.
    return np.array([x, y]) / depth - camera[[14, 16]]


@pytest.mark.parametrize("view", VIEWS)
def test_points_are_where_the_ray_casters_rays_meet_them(view):
    camera = camera_array(view, VOLUME)
    last = np.array(VOLUME.dimensions) - 1
    expected = [place_by_ray(camera, corner * last) for corner in CORNERS]
    projection = Projection(view, VOLUME.proportions)
    np.testing.assert_allclose(projection.places(CORNERS), expected, atol=1e-9)
    np.testing.assert_allclose(projection.eye * last, camera[:3], atol=1e-9)


@pytest.mark.parametrize("view", VIEWS[1:3])
@pytest.mark.parametrize("share", [0.0, 0.2, 0.75, 1.0])
def test_a_point_of_a_line_is_found_by_its_image(view, share):
    projection = Projection(view, VOLUME.proportions)
    start, end = np.array([0.1, 0.0, 0.6]), np.array([0.1, 1.0, 0.6])
    places = projection.places(np.stack([start, end, start + share * (end - start)]))
    along = places[1] - places[0]
    # Beside the line, too.
    for aside in (0.0, 0.4, -2.0):
        x, y = places[2] + aside * np.array([-along[1], along[0]])
        assert projection.nearest_on((x, y), start, end) == pytest.approx(share, abs=1e-9)
    x, y = places[0] - along
    assert projection.nearest_on((x, y), start, end) == pytest.approx(0.0, abs=1e-9)


def test_a_line_along_the_line_of_sight_has_no_nearest_point():
    projection = Projection(View(0.0, 0.0), VOLUME.proportions)
    line = np.array([[0.5, 0.0, 0.5], [0.5, 1.0, 0.5]])
    assert projection.nearest_on((0.2, 0.1), *line) is None


def test_a_line_behind_the_eye_is_cut_off():
    # Close to a corner, so that this is behind the eye.
    projection = Projection(View(45.0, 35.0, distance=0.15), (3**-0.5,) * 3)
    near, far = np.array([1.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0])
    assert projection.depths(near[None])[0] < 0
    part = projection.seen_part(near, far)
    assert projection.depths(part)[0] == pytest.approx(NEAREST_DEPTH)
    np.testing.assert_array_equal(part[1], far)
    assert projection.seen_part(near, near) is None
    # Any place of the image means a point of the part that is seen.
    for x in (-50.0, 0.0, 50.0):
        share = projection.nearest_on((x, 0.0), near, far)
        assert share is not None
        assert 1 - part[0][0] - 1e-9 <= share <= 1


PROPORTIONS = (0.4, 0.6, 0.69)
VIEW = View(25.0, -30.0, 12.0, 0.8, 0.1, -0.2)


@pytest.mark.parametrize("up", AXES)
def test_equal_steps_about_the_up_axis(up):
    views = turntable(VIEW, 8, up, PROPORTIONS)
    assert len(views) == 8 and views[0] == VIEW
    axis = np.array(axis_direction(up), dtype=float)
    bases = [view.basis() for view in (*views, views[0])]
    for before, after in pairwise(bases):
        # As rows, so the rotation of the camera in the volume.
        rotation = after.T @ before
        np.testing.assert_allclose(rotation @ axis, axis, atol=1e-9)
        assert np.trace(rotation) == pytest.approx(1 + 2 * np.cos(np.radians(45)))
    assert {view.distance for view in views} == {VIEW.distance}


def test_the_pivot_stays_where_it_is():
    pivot = (0.2, 0.9, 0.4)
    places = [
        Projection(view, PROPORTIONS).places(np.array(pivot)[None])[0]
        for view in turntable(VIEW, 12, "+z", PROPORTIONS, pivot)
    ]
    np.testing.assert_allclose(places, np.tile(places[0], (12, 1)), atol=1e-9)


def test_what_is_in_front_moves_to_the_right():
    views = turntable(View(0.0, 10.0), 36, "+z", PROPORTIONS)
    front = np.array([[0.5, 0.1, 0.5]])
    first, second = (Projection(view, PROPORTIONS).places(front)[0, 0] for view in views[:2])
    assert second > first
