from __future__ import annotations

import numpy as np
import pytest
from ramp import make_tf

from model.scene.tf_emphasis import (
    STRIKING_COLORS,
    add_striking_mode,
    isolate_value,
    lower_value,
    raise_value,
    recolor_around,
    striking_color,
)
from model.scene.transfer_function import OpacityTF

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
    for value in (100.0, 152.0, 200.0):
        found = add_striking_mode(TF, value, 3.0, 0.3, shown)
        assert found.opacity.modes[:-1] == TF.opacity.modes
        assert found.opacity.modes[-1].mean == value
        assert tuple(found.color(value)) == pytest.approx(striking_color(shown))
        far = np.array([v for v in np.linspace(100, 200, 41) if abs(v - value) > 6.01])
        np.testing.assert_allclose(found.color(far), TF.color(far), atol=0.02)
    assert len(recolor_around(TF.color, 150.0, 3.0, (1.0, 0.0, 0.0)).stops) == 5
