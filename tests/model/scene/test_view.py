"""Views, and where they show points: against VTK's camera and the ray caster's rays."""

import itertools
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vtkmodules.vtkRenderingCore import vtkCamera

from model.scene import orientation
from model.scene.crop import CropBox
from model.scene.region import SQUARE
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import OpacityTF
from model.scene.view import (
    AXES,
    FAR_DISTANCE_RADII,
    NEAREST_DEPTH,
    VIEW_ANGLE,
    Projection,
    View,
    ViewRange,
    axis_direction,
)
from model.scene.volume import Volume

WHOLE_BOX = CropBox()

ups = st.sampled_from(AXES)
views = st.builds(
    View,
    st.floats(0, 360),
    st.floats(-90, 90) | st.sampled_from([-90.0, 90.0, 89.99999, -89.9999999]),
    st.floats(-180, 180),
)
BOXES = [(1.0, 1.0, 1.0), (4.0, 1.0, 0.5), (0.2, 0.3, 5.0), (1.0, 3.0, 0.01)]


PLACED = View(20.0, 10.0, 5.0, 0.7, 0.1, -0.2, is_orthographic=True)


def proportions_of(lengths):
    x, y, z = np.array(lengths) / np.linalg.norm(lengths)
    return float(x), float(y), float(z)


@settings(max_examples=25)
@given(views)
def test_a_view_is_rebuilt_from_its_axes(view):
    again = PLACED.with_basis(view.basis())
    np.testing.assert_allclose(again.basis(), view.basis(), atol=1e-9)
    angles = {"azimuth": 0.0, "elevation": 0.0, "roll": 0.0}
    assert replace(again, **angles) == replace(PLACED, **angles)


@pytest.mark.parametrize("elevation", [-90.0, 90.0])
def test_at_a_pole_there_is_no_roll(elevation):
    view = View(40.0, elevation, 25.0)
    again = View().with_basis(view.basis())
    assert (again.elevation, again.roll) == (elevation, 0.0)
    np.testing.assert_allclose(again.basis(), view.basis(), atol=1e-12)


@settings(max_examples=25)
@given(st.floats(-1e4, 1e4), st.floats(-90, 90), st.floats(-1e4, 1e4))
def test_with_z_up_angles_are_the_views_own_to_the_bit(a, e, r):
    view = orientation.view_in("+z", a, e, r, PLACED)
    assert view == replace(PLACED, azimuth=a, elevation=e, roll=r)
    assert orientation.angles_in("+z", view) == (a, e, r)
    assert orientation.view_in("+z", a, e, r, front="-y").azimuth == a


@settings(max_examples=25)
@given(ups, ups, st.floats(0, 359), st.floats(-89, 89), st.floats(-179, 179))
def test_angles_come_back(up, front, a, e, r):
    view = orientation.view_in(up, a, e, r, PLACED, front=front)
    azimuth, elevation, roll = orientation.angles_in(up, view, front=front)
    assert (azimuth - a + 180) % 360 - 180 == pytest.approx(0, abs=1e-7)
    assert (elevation, roll) == pytest.approx((e, r), abs=1e-7)
    assert view.with_basis(PLACED.basis()) == PLACED


@settings(max_examples=25)
@given(ups, ups)
def test_faces_are_what_the_camera_of_vtk_sees(up, front):
    found = orientation.faces(up, front)
    assert sorted(found.values()) == sorted(AXES)
    if front[1] != up[1]:
        assert found["Front"] == front
    assert found["Top"] == up
    camera = vtkCamera()
    camera.SetViewUp(*axis_direction(up))
    camera.SetPosition(*axis_direction(found["Front"]))
    camera.SetFocalPoint(0, 0, 0)
    for name in ("Front", "Right", "Back", "Left"):
        assert camera.GetPosition() == pytest.approx(axis_direction(found[name]), abs=1e-9)
        camera.Azimuth(90.0)


def projected(view, proportions, box=WHOLE_BOX, places=None):
    """Places or corners of a box in the image, in halves of its height, by VTK's camera."""
    # The bounding sphere's diameter is 1.
    _, up, back = view.basis()
    camera = vtkCamera()
    camera.SetFocalPoint(0, 0, 0)
    camera.SetPosition(*(view.camera_distance(0.5) * back))
    camera.SetViewUp(*up)
    camera.SetViewAngle(VIEW_ANGLE)
    camera.SetClippingRange(0.01, 100.0)
    matrix = camera.GetCompositeProjectionTransformMatrix(1.0, -1.0, 1.0)
    rows = np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])
    if places is None:
        places = np.array(list(itertools.product(*zip(box.low, box.high, strict=True))))
    image = np.column_stack([(places - 0.5) * proportions, np.ones(len(places))]) @ rows.T
    return image[:, :2] / image[:, 3:]


@pytest.mark.parametrize("reach", [SQUARE, (1.5, 0.5), (0.5, 0.8)])
@pytest.mark.parametrize("lengths", BOXES)
@settings(max_examples=25)
@given(views)
def test_a_box_at_the_fit_distance_just_fits_the_width_or_the_height(lengths, reach, view):
    proportions = proportions_of(lengths)
    at = replace(view, distance=orientation.fit_distance(proportions, view, reach=reach))
    across, along = np.abs(projected(at, proportions)).max(axis=0) / (2 * np.array(reach))
    assert max(across, along) == pytest.approx(1 - orientation.MARGIN)


@pytest.mark.parametrize("reach", [(1.5, 0.5), (0.5, 0.8), (0.5, 0.5)])
@pytest.mark.parametrize("up", AXES)
def test_the_home_view_is_filled_by_the_part_that_is_shown(up, reach):
    proportions = proportions_of((1.0, 0.8, 1.3))
    box = CropBox((0.3, 0.2, 0.25), (0.8, 0.6, 0.75))
    home = orientation.home_view(proportions, up, points=orientation.corners(box), reach=reach)
    image = projected(home, proportions, box) + np.array([home.pan_x, home.pan_y])
    low, high = image.min(axis=0), image.max(axis=0)
    width, height = (high - low) / (4 * np.array(reach))
    filled = [height / orientation.FILLED, width / (1 - orientation.MARGIN)]
    if reach == SQUARE:
        # Models' pictures are not panned: what lies beside the middle is all in the image.
        assert (home.pan_x, home.pan_y) == (0.0, 0.0)
        filled.append(np.abs(image).max() / (1 - orientation.MARGIN))
    else:
        np.testing.assert_allclose(low, -high, atol=1e-6)
    assert max(filled) == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("lengths", BOXES)
def test_beside_a_model_the_home_view_is_within_its_training(lengths):
    home = orientation.home_view(proportions_of(lengths), points=0.1 * orientation.WHOLE + 0.45)
    assert home.distance == orientation.NEAREST_HOME
    assert orientation.home_view(proportions_of(lengths)).distance <= orientation.FARTHEST_HOME


EVEN = (1.0, 1.0, 1.0)
SHOWN = {
    "a ball in a corner": (
        (90, 100, 110), EVEN, (30, 15),
        lambda x, y, z: (x - 90) ** 2 + (y - 80) ** 2 + (z - 72) ** 2 < 15**2,
    ),
    "a slab that lies": (
        (60, 80, 100), EVEN, (30, 35),
        lambda x, y, z: (abs(x - 50) < 40) & (abs(y - 40) < 35) & (abs(z - 42) < 2),
    ),
    "a slab that faces the side": (
        (80, 80, 60), EVEN, (60, 15),
        lambda x, y, z: (abs(x - 42) < 2) & (abs(y - 40) < 35) & (abs(z - 40) < 30),
    ),
    "a bar of long voxels": (
        (20, 60, 60), (0.5, 0.5, 3.0), (30, 15),
        lambda x, y, z: (abs(x - 30) < 5) & (abs(y - 20) < 5) & (abs(z - 10) < 7),
    ),
}  # fmt: skip
"""Shape (nz, ny, nx), spacing, best azimuth and elevation, and which voxels are shown."""


@pytest.mark.parametrize("reach", [(0.7, 0.5), (1.5, 0.5)])
@pytest.mark.parametrize("name", SHOWN)
def test_what_the_tf_shows_fills_the_height_of_the_image_from_its_best_side(name, reach):
    shape, spacing, angles, is_shown = SHOWN[name]
    z, y, x = np.indices(shape) + 0.5
    shown = is_shown(x, y, z)
    volume = Volume(np.where(shown, 200, 20).astype(np.uint8), spacing)
    opacity = OpacityTF((20.0, 200.0), points=((100.0, 0.0), (200.0, 0.9)))
    points = ThinnedVolume.of(volume).shown_points(opacity)
    home = orientation.home_view(volume.proportions, points=points, reach=reach)
    assert (home.azimuth, home.elevation) == angles
    # All corners of the cells that are shown, in the picture of VTK's camera.
    ends = (np.argwhere(shown)[:, None, ::-1] + orientation.WHOLE).reshape(-1, 3)
    image = projected(home, volume.proportions, places=ends / volume.dimensions)
    image += (home.pan_x, home.pan_y)
    width, height = np.ptp(image, axis=0) / (4 * np.array(reach))
    assert height == pytest.approx(orientation.FILLED, abs=0.025) or (
        width == pytest.approx(1 - orientation.MARGIN, abs=0.025) and height < orientation.FILLED
    )
    # Off the middle by a voxel at most: only every second one of the large box is looked at.
    assert np.abs(image.max(axis=0) + image.min(axis=0)).max() < 0.1


@pytest.mark.parametrize(
    ("lengths", "angles"),
    [((1.0, 0.6, 1.2), (0, 15)), ((0.1, 1.0, 1.2), (30, 15)), ((1.0, 1.0, 0.1), (0, 35))],
)
def test_a_patient_is_seen_from_the_front_unless_a_neighbour_shows_much_more(lengths, angles):
    home = orientation.home_view(proportions_of(lengths), front="-y")
    assert (home.azimuth, home.elevation) == angles
    # The same in another frame.
    x, y, z = lengths
    turned = orientation.home_view(proportions_of((y, z, x)), "-y", front="+x")
    assert orientation.angles_in("-y", turned, front="+x") == pytest.approx((*angles, 0), abs=1e-6)


@pytest.mark.parametrize("name", orientation.STANDARD_VIEWS)
def test_standard_views_look_from_their_faces(name):
    view = orientation.standard_view(name, PLACED, "-y", front="+x")
    towards = axis_direction(orientation.faces("-y", "+x")[name])
    assert view.basis()[2] == pytest.approx(towards, abs=1e-9)
    assert view.with_basis(PLACED.basis()) == replace(PLACED, pan_x=0.0, pan_y=0.0)


def test_azimuth_0_and_360_give_the_same_bits():
    assert np.array_equal(View(0.0, 20.0, 5.0).basis(), View(360.0, 20.0, 5.0).basis())
    view_range = ViewRange()
    assert np.array_equal(View(-360.0).vector(view_range), View(0.0).vector(view_range))


def test_axes_of_known_views():
    right, up, back = View(0.0, 0.0).basis()
    np.testing.assert_allclose([right, up, back], [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-15)
    np.testing.assert_allclose(View(90.0, 0.0).basis()[2], [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(View(0.0, 90.0).basis()[2], [0, 0, 1], atol=1e-15)
    # A roll of 90 degrees turns the camera counter-clockwise: its right becomes the old up.
    np.testing.assert_allclose(View(0.0, 0.0, 90.0).basis()[0], [0, 0, 1], atol=1e-15)


def test_bounding_sphere_fills_the_image_at_distance_1():
    # The tangent to the sphere of radius r from distance d has sine r / d.
    d = View(distance=1.0).camera_distance(7.0)
    assert math.degrees(math.asin(7.0 / d)) == pytest.approx(15.0)
    assert d == FAR_DISTANCE_RADII * 7.0


@given(st.sampled_from(AXES), st.floats(0, 360), st.floats(-80, 80), st.floats(-10, 10))
def test_vectors_are_about_the_ranges_up_axis(up, a, e, r):
    view_range = ViewRange(up=up)
    view = orientation.view_in(up, a, e, r, View(distance=0.7))
    vector = view.vector(view_range)
    assert np.abs(vector).max() <= 1 + 1e-6
    # Elevation and roll from the axes alone: how far the camera is above the plane, and how
    # far the up axis leans in the image.
    right, above, back = view.basis() @ axis_direction(up)
    assert math.degrees(math.asin(back)) == pytest.approx(e, abs=1e-6)
    assert vector[0] * view_range.max_elevation == pytest.approx(e, abs=1e-4)
    lean = math.degrees(math.atan2(right, above))
    assert vector[3] * view_range.max_roll == pytest.approx(lean, abs=1e-4)


OBLONG = Volume(np.arange(6 * 5 * 4, dtype=np.float32).reshape(6, 5, 4), spacing=(1.0, 2.0, 0.5))


@pytest.mark.parametrize(
    "view", [View(30.0, 15.0, 40.0, 0.6, 0.3, -0.2), View(200.0, -70.0, -5.0, 1.4, -1.0, 0.1)]
)
@pytest.mark.parametrize("share", [0.0, 0.2, 0.75, 1.0])
def test_a_point_of_a_line_is_found_by_its_image(view, share):
    projection = Projection(view, OBLONG.proportions)
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
    projection = Projection(View(0.0, 0.0), OBLONG.proportions)
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
    views = orientation.turntable(VIEW, 8, up, PROPORTIONS)
    assert len(views) == 8 and views[0] == VIEW
    axis = np.array(axis_direction(up), dtype=float)
    bases = [view.basis() for view in (*views, views[0])]
    for before, after in pairwise(bases):
        # As rows, so the rotation of the camera in the volume.
        rotation = after.T @ before
        np.testing.assert_allclose(rotation @ axis, axis, atol=1e-9)
        assert np.trace(rotation) == pytest.approx(1 + 2 * np.cos(np.radians(45)))
    assert {view.distance for view in views} == {VIEW.distance}
