import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from model.scene import tf_editing as edits
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction

RANGE = (100.0, 200.0)
MODES = OpacityTF(RANGE, (GaussianMode(130.0, 8.0, 0.5), GaussianMode(170.0, 8.0, 0.5)))
CURVE = OpacityTF(RANGE, points=((100.0, 0.0), (140.0, 0.8), (160.0, 0.3), (200.0, 1.0)))
COLOR = ColorTF(RANGE, ((100.0, 0.0, 0.0, 0.0), (150.0, 1.0, 0.5, 0.0), (200.0, 1.0, 1.0, 1.0)))

anywhere = st.floats(-1e6, 1e6)


@given(st.integers(0, 1), anywhere, anywhere)
def test_a_mode_stays_in_the_range(index, value, height):
    moved = edits.move_opacity_handle(MODES, index, value, height)
    mode = moved.modes[index]
    assert (mode.mean, mode.amplitude) == (np.clip(value, *RANGE), np.clip(height, 0, 1))
    assert mode.width == 8.0
    assert moved.modes[1 - index] == MODES.modes[1 - index]


def test_a_mode_outside_stays_there_when_only_its_opacity_changes():
    lo, hi = RANGE
    outside = OpacityTF(RANGE, (GaussianMode(hi + 50, 8.0, 0.5),))
    changed = edits.move_opacity_handle(outside, 0, hi + 50, 0.6)
    assert (changed.modes[0].mean, changed.modes[0].amplitude) == (hi + 50, 0.6)
    assert edits.move_opacity_handle(outside, 0, hi + 90, 0.6).modes[0].mean == hi + 50
    assert edits.move_opacity_handle(outside, 0, lo - 90, 0.6).modes[0].mean == lo


@given(st.integers(0, 3), anywhere, anywhere)
def test_a_point_stays_between_its_neighbours(index, value, height):
    moved = edits.move_opacity_handle(CURVE, index, value, height)
    values = [p[0] for p in moved.points]
    assert values == sorted(values)
    assert (values[0], values[-1]) == RANGE


@given(anywhere)
def test_a_width_is_at_least_a_bin_and_at_most_the_range(width):
    resized = edits.resize_mode(MODES, 0, width)
    assert resized.modes[0].width == np.clip(width, 100 / 256, 100)


@pytest.mark.parametrize(("opacity", "place"), [(MODES, 2), (CURVE, 2)])
def test_an_added_handle_takes_its_place_and_can_be_removed(opacity, place):
    added, index = edits.add_opacity_handle(opacity, 150.0, 0.25)
    assert index == place
    assert edits.opacity_handles(added)[index] == (150.0, 0.25)
    assert edits.remove_opacity_handle(added, index) == opacity


@pytest.mark.parametrize("index", [0, 3])
def test_the_ends_of_a_curve_cannot_be_removed(index):
    assert not edits.can_remove_opacity_handle(CURVE, index)
    assert edits.remove_opacity_handle(CURVE, index) == CURVE


INSIDE = OpacityTF(RANGE, points=((120.0, 0.0), (140.0, 0.8), (180.0, 0.3)))


@given(st.integers(0, 2), anywhere)
def test_an_end_within_the_range_moves_as_any_point_does(index, value):
    # As of a preset for some Hounsfield units.
    moved = edits.move_opacity_handle(INSIDE, index, value, 0.5)
    low, high = [(100.0, 140.0), (120.0, 180.0), (140.0, 200.0)][index]
    assert moved.points[index][0] == np.clip(value, low, high)
    assert edits.opacity_limits(INSIDE, index) == (low, high)


@given(st.floats(-500.0, 500.0))
def test_a_whole_curve_within_the_range_is_shifted_to_its_ends(shift):
    moved = edits.move_opacity_handles(INSIDE, [0, 1, 2], shift, 0.0)
    by = np.clip(shift, -20.0, 20.0)
    assert [p[0] for p in moved.points] == pytest.approx([120.0 + by, 140.0 + by, 180.0 + by])


def test_an_end_within_the_range_can_be_removed_while_two_points_stay():
    assert edits.remove_opacity_handle(INSIDE, 0).points == INSIDE.points[1:]
    two = edits.remove_opacity_handle(INSIDE, 2)
    assert two.points == INSIDE.points[:2]
    assert edits.remove_opacity_handle(two, 0) == two


def test_the_last_mode_can_be_removed():
    empty = OpacityTF(RANGE)
    assert edits.remove_opacity_handle(OpacityTF(RANGE, MODES.modes[:1]), 0) == empty


@given(anywhere)
def test_an_added_stop_changes_no_color_and_is_no_end(value):
    added, index = edits.add_stop(COLOR, value)
    values = np.linspace(*RANGE, 201)
    np.testing.assert_allclose(added(values), COLOR(values), atol=1e-9)
    assert not edits.is_end_stop(added, index)
    assert edits.remove_stop(added, index) == COLOR


@given(st.integers(0, 2), anywhere)
def test_a_stop_stays_between_its_neighbours_and_ends_stay(index, value):
    moved = edits.move_stop(COLOR, index, value)
    values = [s[0] for s in moved.stops]
    assert values == sorted(values)
    assert (values[0], values[-1]) == RANGE
    assert [s[1:] for s in moved.stops] == [s[1:] for s in COLOR.stops]


def test_end_stops_cannot_be_removed_but_recoloured():
    assert edits.remove_stop(COLOR, 0) == COLOR
    assert edits.remove_stop(COLOR, 2) == COLOR
    recolored = edits.recolor_stop(COLOR, 2, (0.1, 0.2, 0.3))
    assert recolored(200.0) == pytest.approx([0.1, 0.2, 0.3])


@given(st.lists(st.integers(0, 3), min_size=1, unique=True), anywhere, anywhere)
def test_points_that_move_together_keep_their_distances(indices, shift, lift):
    moved = edits.move_opacity_handles(CURVE, indices, shift, lift)
    values, before = np.array(moved.points)[:, 0], np.array(CURVE.points)[:, 0]
    assert (np.diff(values) >= 0).all()
    assert (values[[0, 3]] == before[[0, 3]]).all()
    inner = [i for i in indices if i in (1, 2)]
    shifts = (values - before)[inner]
    assert np.ptp(shifts) == pytest.approx(0, abs=1e-9) if inner else True
    still = [i for i in range(4) if i not in indices]
    assert [moved.points[i] for i in still] == [CURVE.points[i] for i in still]


@given(anywhere)
def test_modes_that_move_together_stop_together(shift):
    moved = edits.move_opacity_handles(MODES, (0, 1), shift, 0.0)
    assert moved.modes[0].mean == pytest.approx(130 + np.clip(shift, -30, 30))
    assert moved.modes[1].mean - moved.modes[0].mean == pytest.approx(40)


@given(st.floats(-60, 60))
def test_a_stop_follows_its_mode_past_other_stops(shift):
    stops = ((100.0, 0, 0, 0), (130.0, 1, 0, 0), (150.0, 0, 1, 0), (200.0, 1, 1, 1))
    before = TransferFunction(MODES, ColorTF(RANGE, stops))
    opacity = edits.move_opacity_handle(MODES, 0, 130 + shift, 0.5)
    after = edits.follow_modes(before, opacity)
    assert after.opacity == opacity
    moved = (float(np.clip(130 + shift, 100, 200)), 1, 0, 0)
    assert set(after.color.stops) == {stops[0], moved, stops[2], stops[3]}
    assert [s[0] for s in after.color.stops] == sorted(s[0] for s in after.color.stops)
    assert (after.color.stops[0], after.color.stops[-1]) == (stops[0], stops[-1])
