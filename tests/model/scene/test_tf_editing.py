from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ramp import make_tf

from model.scene import tf_editing as edits
from model.scene.tf_emphasis import (
    STRIKING_COLORS,
    add_striking_mode,
    isolate_value,
    lower_value,
    raise_value,
    striking_color,
)
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


def test_ends_of_the_range_and_the_last_two_points_cannot_be_removed():
    for index in (0, 3):
        assert not edits.can_remove_opacity_handle(CURVE, index)
        assert edits.remove_opacity_handle(CURVE, index) == CURVE
    assert edits.remove_opacity_handle(INSIDE, 0).points == INSIDE.points[1:]
    two = edits.remove_opacity_handle(INSIDE, 2)
    assert two.points == INSIDE.points[:2]
    assert edits.remove_opacity_handle(two, 0) == two
    assert edits.remove_opacity_handle(OpacityTF(RANGE, MODES.modes[:1]), 0) == OpacityTF(RANGE)


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


TF = make_tf()  # modes at 130 and 170, .5 high, over 100..200
POINTS = OpacityTF((100.0, 200.0), points=((100.0, 0.0), (150.0, 0.4), (200.0, 0.1)))
NOTHING = OpacityTF((100.0, 200.0))


def at(opacity, value):
    return float(opacity(np.array([value]))[0])


@pytest.mark.parametrize("opacity", [TF.opacity, POINTS, NOTHING])
@pytest.mark.parametrize("value", [100.0, 130.0, 151.0, 200.0])
def test_values_are_doubled_and_halved(opacity, value):
    now = at(opacity, value)
    raised, lowered = (f(opacity, value, 3.0, (value, value)) for f in (raise_value, lower_value))
    is_there = now > 0.1 or bool(opacity.points and now)
    assert at(raised, value) == pytest.approx(min(2 * now if is_there else now + 0.05, 1), abs=0.02)
    assert at(lowered, value) <= now
    if is_there:
        assert at(lowered, value) == pytest.approx(0.5 * now, rel=0.02)
        # What there is grows: nothing is put on top of it.
        assert len(raised.modes) == len(opacity.modes)
    far = value + 60 if value < 150 else value - 60
    for edited in (raised, lowered):
        assert at(edited, far) == pytest.approx(at(opacity, far), abs=1e-3)


@given(
    st.lists(st.tuples(st.floats(100, 200), st.floats(1, 60), st.floats(0.01, 0.5)), min_size=1),
    st.integers(0, 100),
)
def test_lowering_undoes_raising_but_for_rounding(modes, chosen):
    opacity = OpacityTF((100.0, 200.0), tuple(GaussianMode(*mode) for mode in modes))
    value = modes[chosen % len(modes)][0]
    for one, other in ((raise_value, lower_value), (lower_value, raise_value)):
        where = value, 3.0, (value, value)
        back = other(one(opacity, *where), *where)
        assert [m.mean for m in back.modes] == [m.mean for m in opacity.modes]
        for mode, before in zip(back.modes, opacity.modes, strict=True):
            assert mode.amplitude == pytest.approx(before.amplitude, rel=1e-12)


@pytest.mark.parametrize("opacity", [TF.opacity, POINTS])
def test_all_of_a_named_range_is_doubled(opacity):
    raised = raise_value(opacity, 131.0, 3.0, (128.0, 150.0))
    for value in (128.0, 131.0, 145.0):
        assert at(raised, value) == pytest.approx(2 * at(opacity, value), rel=0.1)
    assert at(raised, 185.0) == pytest.approx(at(opacity, 185.0), rel=0.05)


def test_of_a_curve_the_values_in_reach_are_isolated():
    points = ((100.0, 0.0), (120.0, 0.2), (160.0, 0.6), (200.0, 0.8))
    curve = OpacityTF((100.0, 200.0), points=points)
    alone = isolate_value(curve, 150.0, 3.0, (130.0, 170.0))
    for value in (133.0, 150.0, 160.0, 167.0):
        assert at(alone, value) == pytest.approx(at(curve, value), abs=1e-6)
    for value in (100.0, 120.0, 130.0, 170.0, 200.0):
        assert at(alone, value) == 0.0
    # In the middle of the flanks it has half of the height.
    for value, inner in ((131.5, 133.0), (168.5, 167.0)):
        assert at(alone, value) == pytest.approx(at(curve, inner) / 2, abs=1e-6)
    assert len(alone.points) == 7
    # Up to the ends of the range, and there is nothing to keep where nothing was.
    high = isolate_value(curve, 190.0, 3.0, (170.0, 200.0))
    assert at(high, 199.0) == pytest.approx(at(curve, 199.0))
    assert isolate_value(curve, 100.0, 3.0, (100.0, 100.0)).modes


@given(
    st.lists(st.tuples(st.floats(90, 210), st.floats(1, 80), st.floats(0.05, 0.3)), max_size=3),
    st.floats(100, 190),
    st.floats(0, 60),
)
def test_of_modes_the_values_in_reach_are_left_alone(modes, low, size):
    wide = GaussianMode(low + size / 2, 2 * size + 20, 0.3)
    opacity = OpacityTF((100.0, 200.0), (wide, *(GaussianMode(*mode) for mode in modes)))
    high = min(low + size, 200.0)
    alone = isolate_value(opacity, low, 3.0, (low, high))
    values = np.linspace(100.0, 200.0, 401)
    middle, half = (low + high) / 2, max(high - low, 3.0) / 2
    inside, beyond = abs(values - middle) <= half / 2, abs(values - middle) > half + 1e-9
    least = 0.9 * OpacityTF((100.0, 200.0), (wide,))(values[inside])
    assert (alone(values)[inside] >= least).all()
    assert not alone(values)[beyond].any()


def test_the_colour_is_far_from_what_is_shown():
    for color in STRIKING_COLORS:
        shown = np.tile(color, (900, 1))
        assert striking_color(shown) != color
    orange = np.tile((0.9, 0.6, 0.1), (50, 1))
    r, _, b = striking_color(np.concatenate([orange, np.zeros((5000, 3))]))
    assert b > r
    assert striking_color(np.zeros((0, 3))) in STRIKING_COLORS


def test_a_striking_mode_has_its_colour_and_leaves_the_others():
    shown = np.tile((1.0, 1.0, 1.0), (9, 1))
    clear = replace(TF, opacity=NOTHING)
    for value in (100.0, 152.0, 200.0):
        found = add_striking_mode(clear, value, 3.0, 0.3, shown)
        assert found.opacity.modes[-1].mean == value
        assert tuple(found.color(value)) == pytest.approx(striking_color(shown))
        far = np.array([v for v in np.linspace(100, 200, 41) if abs(v - value) > 6.01])
        np.testing.assert_allclose(found.color(far), TF.color(far), atol=0.02)
    assert add_striking_mode(TF, 152.0, 3.0, 0.3, shown).opacity.modes[:-1] == TF.opacity.modes
    # What is opaque keeps its colour, but for the share of what is added.
    change = np.abs(add_striking_mode(TF, 130.0, 3.0, 0.02, shown).color(130.0) - TF.color(130.0))
    assert change.max() <= 1.01 * 0.02 / (0.02 + 0.5)
