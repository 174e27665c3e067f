from itertools import pairwise

import numpy as np
import pytest

from model.scene.axes import AXES, axis_direction
from model.scene.projection import Projection
from model.scene.turntable import turntable
from model.scene.view import View

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
