"""Who draws while something moves, by times that are made up."""

from __future__ import annotations

import pytest

from app.state.live_drawer import LiveDrawer

LIVE_SECONDS = 0.07


@pytest.mark.parametrize(
    ("vtk", "raycast", "is_vtk"),
    [
        (None, 0.01, False),
        # A graphics card keeps up, even where the ray caster would be faster.
        (0.5 * LIVE_SECONDS, 0.1 * LIVE_SECONDS, True),
        # VTK on the processor.
        (20 * LIVE_SECONDS, 4 * LIVE_SECONDS, False),
        # Neither keeps up: the faster one.
        (4 * LIVE_SECONDS, 20 * LIVE_SECONDS, True),
        (0.5 * LIVE_SECONDS, None, True),
        (20 * LIVE_SECONDS, None, False),
    ],
)
def test_the_faster_one_draws(vtk: float | None, raycast: float | None, is_vtk: bool) -> None:
    drawer = LiveDrawer()
    drawer.choose(vtk, raycast, LIVE_SECONDS)
    assert drawer.is_vtk == is_vtk
    assert ("VTK draws" in drawer.reason) == is_vtk
    assert ("the ray caster draws" in drawer.reason) == (vtk is not None and not is_vtk)


def test_equally_fast_ones_do_not_take_turns() -> None:
    drawer = LiveDrawer()
    for begin, stays in ((0.5, True), (2.0, False)):
        drawer.choose(begin * LIVE_SECONDS, None, LIVE_SECONDS)
        for wobble in (0.8, 1.2, 0.9, 1.3, 0.75):
            drawer.choose(wobble * LIVE_SECONDS, LIVE_SECONDS, LIVE_SECONDS)
            assert drawer.is_vtk == stays


def test_what_is_told_changes_with_the_times_only() -> None:
    drawer = LiveDrawer()
    drawer.choose(0.02, None, LIVE_SECONDS)
    told = drawer.reason
    assert "20 ms" in told
    drawer.choose(0.022, None, LIVE_SECONDS)
    assert drawer.reason == told
    drawer.choose(0.03, 0.04, LIVE_SECONDS)
    assert "30 ms" in drawer.reason and "40 ms" in drawer.reason
    drawer.forget()
    assert not drawer.reason and not drawer.is_vtk
