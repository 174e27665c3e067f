from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from ramp import make_tf

from model.scene.tf_emphasis import (
    STRIKING_COLORS,
    add_striking_mode,
    isolate_value,
    lower_value,
    raise_value,
    striking_color,
)
from model.scene.transfer_function import GaussianMode, OpacityTF

TF = make_tf()  # modes at 130 and 170, .5 high, over 100..200
POINTS = OpacityTF((100.0, 200.0), points=((100.0, 0.0), (150.0, 0.4), (200.0, 0.1)))
NOTHING = OpacityTF((100.0, 200.0))


def at(opacity: OpacityTF, value: float) -> float:
    return float(opacity(np.array([value]))[0])


@pytest.mark.parametrize("opacity", [TF.opacity, POINTS, NOTHING])
@pytest.mark.parametrize("value", [100.0, 130.0, 151.0, 200.0])
def test_raising_lowering_and_isolating(opacity: OpacityTF, value: float) -> None:
    now = at(opacity, value)
    raised, lowered = raise_value(opacity, value, 3.0), lower_value(opacity, value, 3.0)
    assert at(raised, value) == pytest.approx(min(1, now + max(0.6 * now, 0.05)), abs=0.02)
    assert at(lowered, value) <= now
    if opacity.points and now:
        assert at(lowered, value) == pytest.approx(0.5 * now, rel=0.02)
    far = value + 60 if value < 150 else value - 60
    assert at(raised, far) == pytest.approx(at(opacity, far), abs=1e-3)
    if opacity.points:
        assert at(lowered, far) == pytest.approx(at(opacity, far), abs=1e-3)
    alone = isolate_value(opacity, value, 3.0)
    assert at(alone, value) >= min(now, 0.5) * 0.99 or at(alone, value) >= 0.05
    assert at(alone, far) < 1e-3


def test_a_mode_at_the_value_is_what_is_isolated() -> None:
    assert isolate_value(TF.opacity, 131.0, 3.0).modes == (TF.opacity.modes[0],)


def test_of_a_curve_the_values_in_reach_are_isolated() -> None:
    points = ((100.0, 0.0), (120.0, 0.2), (160.0, 0.6), (200.0, 0.8))
    curve = OpacityTF((100.0, 200.0), points=points)
    alone = isolate_value(curve, 150.0, 3.0, (130.0, 170.0))
    for value in (131.0, 150.0, 160.0, 169.0):
        assert at(alone, value) == pytest.approx(at(curve, value), abs=1e-6)
    for value in (100.0, 120.0, 126.0, 174.0, 200.0):
        assert at(alone, value) == 0.0
    # Up to the ends of the range, and there is nothing to keep where nothing was.
    high = isolate_value(curve, 190.0, 3.0, (170.0, 200.0))
    assert at(high, 199.0) == pytest.approx(at(curve, 199.0))
    assert isolate_value(curve, 100.0, 3.0, (100.0, 100.0)).modes


def test_a_value_on_a_modes_flank_stays_with_the_whole_mode() -> None:
    wide = GaussianMode(160.0, 26.0, 0.9)
    opacity = OpacityTF((100.0, 200.0), (GaussianMode(110.0, 8.0, 0.2), wide))
    assert isolate_value(opacity, 145.0, 3.0).modes == (wide,)


def test_of_a_wide_mode_no_more_than_the_values_in_reach_is_left() -> None:
    wide = GaussianMode(150.0, 40.0, 0.9)
    opacity = OpacityTF((100.0, 200.0), (wide,))
    alone = isolate_value(opacity, 140.0, 3.0, (135.0, 145.0))
    inside = np.linspace(135.0, 145.0, 101)
    np.testing.assert_allclose(alone(inside), opacity(inside), atol=2e-3)
    outside = np.array([100.0, 131.9, 148.1, 150.0, 200.0])
    assert (alone(outside) == 0).all()


def test_a_mode_that_lies_in_reach_stays_a_mode() -> None:
    narrow = GaussianMode(140.0, 4.0, 0.5)
    opacity = OpacityTF((100.0, 200.0), (narrow, GaussianMode(180.0, 8.0, 0.4)))
    assert isolate_value(opacity, 141.0, 3.0, (134.0, 146.0)).modes == (narrow,)
    # But for where others add to it.
    both = OpacityTF((100.0, 200.0), (narrow, GaussianMode(150.0, 20.0, 0.4)))
    assert isolate_value(both, 141.0, 3.0, (134.0, 146.0)).points


def test_an_opaque_value_cannot_be_raised() -> None:
    opaque = OpacityTF((0.0, 1.0), points=((0.0, 1.0), (1.0, 1.0)))
    assert raise_value(opaque, 0.5, 0.1) == opaque


def test_the_colour_is_far_from_what_is_shown() -> None:
    for color in STRIKING_COLORS:
        shown = np.tile(color, (900, 1))
        assert striking_color(shown) != color
    orange = np.tile((0.9, 0.6, 0.1), (50, 1))
    r, _, b = striking_color(np.concatenate([orange, np.zeros((5000, 3))]))
    assert b > r
    assert striking_color(np.zeros((0, 3))) in STRIKING_COLORS


def test_a_striking_mode_has_its_colour_and_leaves_the_others() -> None:
    shown = np.tile((1.0, 1.0, 1.0), (9, 1))
    clear = replace(TF, opacity=NOTHING)
    for value in (100.0, 152.0, 200.0):
        found = add_striking_mode(clear, value, 3.0, 0.3, shown)
        assert found.opacity.modes[-1].mean == value
        assert tuple(found.color(value)) == pytest.approx(striking_color(shown))
        far = np.array([v for v in np.linspace(100, 200, 41) if abs(v - value) > 6.01])
        np.testing.assert_allclose(found.color(far), TF.color(far), atol=0.02)
    assert add_striking_mode(TF, 152.0, 3.0, 0.3, shown).opacity.modes[:-1] == TF.opacity.modes


@pytest.mark.parametrize("height", [0.02, 0.2])
def test_what_is_opaque_keeps_its_colour_but_for_what_the_mode_adds(height: float) -> None:
    shown = np.tile((1.0, 1.0, 1.0), (9, 1))
    striking = np.array(striking_color(shown))
    found = add_striking_mode(TF, 130.0, 3.0, height, shown)
    values = np.linspace(100, 200, 201)
    added = np.clip(found.opacity(values) - TF.opacity(values), 0, None)
    share = added / np.maximum(added + TF.opacity(values), 1e-12)
    expected = TF.color(values) + share[:, None] * (striking - TF.color(values))
    # Straight lines between the stops, of which there are five.
    weight = np.maximum(TF.opacity(values), 0.02)[:, None]
    assert np.abs(weight * (found.color(values) - expected)).max() < 0.25 * height
    change = np.abs(found.color(130.0) - TF.color(130.0)).max()
    assert change <= 1.01 * height / (height + 0.5)
