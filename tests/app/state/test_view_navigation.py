from dataclasses import replace

import numpy as np
import pytest

from app.image_view.gestures import pan, turn
from model.errors import TfscopeError
from model.scene.crop import CropBox
from model.scene.orientation import STANDARD_VIEWS, WHOLE, corners, home_view
from model.scene.view import Projection, View

BOX = (0.8, 0.48, 0.36)


def test_a_volume_starts_at_its_home_view(qtbot, state):
    state.set_view(View(10.0))
    signals = [state.navigationChanged, state.viewChanged, state.viewChangeFinished]
    with qtbot.waitSignals(signals):
        state.start_view(BOX, "-y")
    assert state.view == state.home == home_view(BOX, "-y")
    assert state.up_axis == "-y"
    given = View(5.0, distance=0.5)
    state.start_view(BOX, view=given)
    assert (state.view, state.up_axis) == (given, "+z")
    state.reset_view()
    assert state.view == home_view(BOX)
    with pytest.raises(TfscopeError, match="'north' is not an axis"):
        state.start_view((1.0, 0.0, 0.0), "north")
    assert state.home == home_view(BOX)


def test_home_shows_a_part_and_the_whole_volume_is_one_step_away(state):
    part = corners(CropBox((0.3, 0.3, 0.3), (0.6, 0.6, 0.6)))
    state.start_view(BOX, "-y", shown=part)
    assert state.view == state.home == home_view(BOX, "-y", points=part)
    state.set_up_axis("+x")
    assert state.view == home_view(BOX, "+x", points=part)
    state.set_view(replace(state.view, pan_x=0.4))
    state.view_whole()
    assert state.view == home_view(BOX, "+x")
    state.set_reach((1.5, 0.5))
    state.view_whole()
    places = Projection(state.view, state.proportions).places(WHOLE)
    assert places.min(axis=0) == pytest.approx(-places.max(axis=0))


def test_the_home_view_follows_the_image_while_it_is_looked_from(state):
    state.start_view(BOX)
    square = state.home
    state.set_reach((1.5, 0.5), follow=True)
    wide = home_view(BOX, reach=(1.5, 0.5))
    assert state.view == state.home == wide
    assert state.home.distance < square.distance
    # Once it has been seen, the image shows what it showed.
    state.set_reach((0.3, 0.5))
    assert state.view == wide != state.home
    # Whoever looks from elsewhere stays there.
    state.set_view(View(77))
    state.set_reach((0.5, 0.5), follow=True)
    assert state.view == View(77) and state.home == square
    # But from the home view's distance, all stays in the image.
    turned = replace(square, azimuth=77.0)
    state.set_view(turned)
    for reach, home in (((1.5, 0.5), wide), ((0.5, 0.5), square)):
        state.set_reach(reach, follow=True)
        assert state.view.distance == home.distance and state.view.azimuth == 77
    state.reset_view()
    assert state.view == square
    state.set_up_axis("-y")
    assert state.view == home_view(BOX, "-y")


def test_turns_are_about_what_is_shown_where_no_model_stands_beside_it(state):
    part = 0.25 * WHOLE + np.array([0.7, 0.05, 0.2])
    middle = part.mean(axis=0)
    proportions = (0.4, 0.5, 0.7681)

    def place():
        return Projection(state.view, proportions).places(middle[None])[0]

    state.start_view(proportions, shown=part, reach=(1.0, 0.5))
    # From the home view, it stays in the middle of the image.
    for _ in range(5):
        state.move_view(turn(state, 70.0, 20.0))
        places = Projection(state.view, proportions).places(part)
        assert places.min(axis=0) == pytest.approx(-places.max(axis=0))
    state.move_view(replace(pan(state.view, 0.2, -0.1), distance=0.5))
    before = place()
    for free in (False, True):
        state.set_trackball(free)
        for _ in range(5):
            state.move_view(turn(state, 70.0, 20.0))
        assert place() == pytest.approx(before)
    state.finish_view()
    for name in STANDARD_VIEWS:
        state.look_from(name)
        assert place() == pytest.approx([0.0, 0.0], abs=1e-9)
    state.move_view(pan(state.view, 0.2, -0.1))
    state.set_up_axis("+x")
    assert place() == pytest.approx([0.2, -0.1])
    # A model's pictures have the volume's centre in their middle.
    state.start_view(proportions, shown=part)
    state.move_view(turn(state, 70.0, 20.0))
    assert (state.view.pan_x, state.view.pan_y) == (0.0, 0.0)


def test_a_picture_has_all_that_is_shown_in_its_middle(state):
    part = 0.25 * WHOLE + np.array([0.7, 0.05, 0.2])
    proportions = (0.4, 0.5, 0.7681)
    state.start_view(proportions, shown=part, reach=(1.0, 0.5))
    view = state.for_picture(View(70.0, -20.0, 10.0, 0.4, 0.9, -0.5))
    assert view.basis() == pytest.approx(View(70.0, -20.0, 10.0).basis())
    places = Projection(view, proportions).places(part)
    low, high = places.min(axis=0), places.max(axis=0)
    assert low + high == pytest.approx([0.0, 0.0], abs=1e-9)
    # It is small enough for the nearest view.
    assert high.max() < 1.0


def test_a_square_picture_shows_what_a_wide_image_shows(state):
    proportions = (0.9, 0.3, 0.3)
    state.start_view(proportions, reach=(1.0, 0.5))

    def places(view):
        return Projection(view, proportions).places(WHOLE)

    assert np.abs(places(state.home)).max() > 1.0
    assert 0.8 < np.abs(places(state.for_square(state.home))).max() < 1.0
    near = replace(state.home, distance=state.home.distance / 3)
    wide, square = places(near), places(state.for_square(near))
    assert 0.2 < np.ptp(square, axis=0)[0] / np.ptp(wide, axis=0)[0] < 0.9
    state.start_view(proportions)
    assert state.for_square(state.home) == state.home
