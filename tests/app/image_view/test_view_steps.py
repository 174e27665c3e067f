from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from app.image_view.gestures import (
    DEGREES_PER_PIXEL,
    orbit,
    pan,
    roll,
    tumble,
    zoom,
)
from model.scene.orientation import view_in
from model.scene.view import AXES, VIEW_ANGLE, View, axis_direction

views = st.builds(
    View,
    azimuth=st.floats(0, 359),
    elevation=st.floats(-60, 60),
    roll=st.floats(-180, 180),
)


@given(views, st.floats(0, 360))
def test_the_volume_follows_the_mouse(view: View, direction: float) -> None:
    dx, dy = np.cos(np.radians(direction)), np.sin(np.radians(direction))
    front = view.basis()[2]
    right, up, _ = orbit(view, dx, dy).basis()
    moved = np.array([front @ right, -(front @ up)])
    assert moved @ [dx, dy] > 0.99 * np.cos(np.radians(view.elevation)) * np.linalg.norm(moved)
    assert moved @ [dx, dy] > 0


@given(views, st.floats(1, 80))
def test_rolling_turns_the_picture_clockwise(view: View, degrees: float) -> None:
    top = view.basis()[1]
    turned = roll(view, degrees)
    right, up, _ = turned.basis()
    assert np.degrees(np.arctan2(top @ right, top @ up)) == pytest.approx(degrees)
    assert -180 <= turned.roll < 180


@pytest.mark.parametrize("up", AXES)
def test_orbiting_turns_about_the_up_axis(up: str) -> None:
    view = view_in(up, 20.0, 35.0, 0.0, 0.6, 0.1, 0.2)
    before, axis = view.basis(), axis_direction(up)
    after = orbit(view, 50.0, 0.0, up)
    # The camera goes round the other way.
    turned = Rotation.from_rotvec(math.radians(-50 * DEGREES_PER_PIXEL) * axis)
    np.testing.assert_allclose(after.basis(), turned.apply(before), atol=1e-9)
    assert (after.distance, after.pan_x, after.pan_y) == (0.6, 0.1, 0.2)
    assert orbit(view, 0, 1000.0, up).basis()[2] == pytest.approx(axis, abs=1e-9)


@given(views, st.floats(-300, 300), st.floats(-300, 300))
def test_tumbling_turns_about_the_images_own_axes(view: View, dx: float, dy: float) -> None:
    after = tumble(replace(view, pan_x=0.5), dx, dy)
    # To the right is about the image's up axis; down about its right one.
    turned = Rotation.from_rotvec(np.radians(DEGREES_PER_PIXEL) * np.array([dy, dx, 0.0]))
    np.testing.assert_allclose(after.basis(), turned.as_matrix() @ view.basis(), atol=1e-8)
    assert after.pan_x == 0.5


def place_of(view: View, point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Place in the image, in halves of its height, of a point given in radii."""
    right, up, back = view.basis() @ point
    depth = view.camera_distance(1.0) - back
    tangent = math.tan(math.radians(VIEW_ANGLE / 2))
    return np.array([right, up]) / depth / tangent + [view.pan_x, view.pan_y]


@given(views, st.floats(-5, 5), st.floats(-1, 1), st.floats(-1, 1))
def test_what_lies_under_the_cursor_stays_there(
    view: View, notches: float, x: float, y: float
) -> None:
    view = replace(view, pan_x=0.3, pan_y=-0.4, distance=0.7)
    right, up, _ = view.basis()
    # The point of the plane through the centre that is seen at (x, y).
    scale = view.camera_distance(1.0) * math.tan(math.radians(VIEW_ANGLE / 2))
    point = scale * ((x - view.pan_x) * right + (y - view.pan_y) * up)
    np.testing.assert_allclose(place_of(view, point), [x, y], atol=1e-9)
    np.testing.assert_allclose(place_of(zoom(view, notches, (x, y)), point), [x, y], atol=1e-9)


def test_panning_moves_every_point_by_the_same() -> None:
    view = View(30.0, 10.0, distance=0.5)
    for point in (np.zeros(3), np.array([0.3, -0.2, 0.5])):
        moved = place_of(pan(view, 0.25, -0.5), point) - place_of(view, point)
        np.testing.assert_allclose(moved, [0.25, -0.5], atol=1e-12)
