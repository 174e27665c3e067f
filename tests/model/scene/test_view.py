import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.errors import ViewError
from model.scene.axes import AXES, axis_direction
from model.scene.orientation import view_in
from model.scene.view import FAR_DISTANCE_RADII, View, ViewRange

angles = st.floats(-720, 720)


@given(angles, st.floats(-90, 90), angles)
def test_basis_is_a_rotation(azimuth, elevation, roll):
    basis = View(azimuth, elevation, roll).basis()
    np.testing.assert_allclose(basis @ basis.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(basis) == pytest.approx(1.0)


@pytest.mark.parametrize("roll", [-10.0, 0.0, 25.0])
def test_basis_is_continuous_through_both_poles(roll):
    bases = np.array([View(33.0, float(e), roll).basis() for e in range(-90, 91)])
    steps = np.linalg.norm(np.diff(bases, axis=0), axis=(1, 2))
    assert steps.max() < 1.5 * math.radians(1.0)


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


@given(st.floats(0, 360), st.floats(-80, 80), st.floats(-10, 10), st.floats(0.4, 1.0))
def test_vector_fills_minus_one_to_one(a, e, r, d):
    vector = View(a, e, r, d).vector(ViewRange())
    assert vector.shape == (5,)
    assert np.abs(vector).max() <= 1 + 1e-6


def test_vector_of_the_ranges_ends():
    vector = View(90.0, -80.0, 10.0, 0.4).vector(ViewRange())
    np.testing.assert_allclose(vector, [-1, 0, 1, 1, -1], atol=1e-6)


def test_parse():
    assert View.parse("30,-20,5,0.8") == View(30.0, -20.0, 5.0, 0.8)
    assert View.parse("30") == View(30.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("north", "is not a view"),
        ("1,2,3,4,5,6,7", "is not a view"),
        ("0,91,0,1", "from -90 to 90"),
        ("0,0,0,0", "above 0"),
        ("nan,0,0,1", "finite"),
        ("", "is not a view"),
    ],
)
def test_bad_views_get_one_sentence(text, message):
    with pytest.raises(ViewError, match=message):
        View.parse(text)


@given(st.sampled_from(AXES), st.floats(0, 360), st.floats(-80, 80), st.floats(-10, 10))
def test_vectors_are_about_the_ranges_up_axis(up, a, e, r):
    view_range = ViewRange(up=up)
    view = view_in(up, a, e, r, 0.7)
    vector = view.vector(view_range)
    assert np.abs(vector).max() <= 1 + 1e-6
    # Elevation and roll from the axes alone: how far the camera is above the plane, and how
    # far the up axis leans in the image.
    right, above, back = view.basis() @ axis_direction(up)
    assert math.degrees(math.asin(back)) == pytest.approx(e, abs=1e-6)
    assert vector[0] * view_range.max_elevation == pytest.approx(e, abs=1e-4)
    lean = math.degrees(math.atan2(right, above))
    assert vector[3] * view_range.max_roll == pytest.approx(lean, abs=1e-4)


def test_a_view_range_has_one_of_the_volumes_axes_up():
    with pytest.raises(ViewError, match="not an axis"):
        ViewRange(up="z")
