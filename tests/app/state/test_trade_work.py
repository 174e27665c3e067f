"""Measuring of what moving images cost: at rest, for later, and never in the way."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot
from rested_window import rested
from window_fakes import FakeBuilders

from app.engines.requests import RegionSensitivityRequest
from app.state import trade_work
from app.state.exactness import STEPS, USUAL
from app.state.fidelity import figures_text
from app.state.pace import SCALES
from app.state.preferences import Preferences, PreferencesStore
from app.state.trade_keeper import AtRest, Traded, TradeKeeper, machine_name
from app.state.trade_work import ENOUGH
from app.window.main_window import MainWindow
from model.scene.view import View

Maker = Callable[..., MainWindow]


@pytest.fixture(autouse=True)
def short_rest(monkeypatch: pytest.MonkeyPatch, nothing_measured_at_rest: None) -> None:
    monkeypatch.setattr(trade_work, "REST_MS", 30)


def trades(builders: FakeBuilders) -> int:
    engine = builders.references[-1]
    return sum(each.is_measured for each in engine.requests)


def test_a_window_at_rest_measures_for_later(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    qtbot.waitUntil(lambda: trade.is_complete)
    kept = window.preferences.volume(window.workspace.opened.fingerprint).trades
    assert [(each.machine, each.lighting, each.scenes) for each in kept] == [
        (machine_name(), "direct", 1)
    ]
    assert [each[0] for each in kept[0].images] == sorted(SCALES)
    # One scene is measured once.
    before = trades(builders)
    qtbot.wait(100)
    assert trades(builders) == before >= 2 * len(SCALES)


def test_figures_are_predicted_until_something_has_moved(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    qtbot.waitUntil(lambda: trade.is_complete)
    figures, moving = window.exactness.figures, window.exactness._line
    assert moving is not None and moving.moving == ""
    here = trade.at(STEPS[USUAL])
    assert here is not None and figures.text() == figures_text(here.seconds, here.error)
    # Opened again, it is not measured yet.
    trade.pause(True)
    with qtbot.waitSignal(window.workspace.settled):
        window.workspace.reading.open(Path("ramp"))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    expected = trade.expected(STEPS[USUAL])
    assert expected is not None and moving.moving == ""
    assert figures.text() == "~" + figures_text(expected.seconds, expected.error)


def test_what_is_asked_for_comes_first(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    engine = builders.references[-1]
    qtbot.waitUntil(lambda: trade.is_complete)
    engine.gate = threading.Semaphore(0)
    window.state.set_view(View(50, 20))
    engine.gate.release(20)
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    while engine.gate.acquire(blocking=False):
        pass
    qtbot.waitUntil(lambda: trade.is_measuring)
    asked = RegionSensitivityRequest
    before = sum(isinstance(each, asked) for each in builders.analysts[-1].others)
    window.workspace.sensitivity.ask()
    assert not trade.is_measuring
    engine.gate.release(50)
    qtbot.waitUntil(
        lambda: sum(isinstance(each, asked) for each in builders.analysts[-1].others) > before
    )
    qtbot.waitUntil(lambda: trade.is_complete)


def test_nothing_is_measured_beside_a_training_nor_when_enough_is_known(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = make_window(model=None, size="pane")
    work = window.workspace.reference
    work.trade.pause(True)
    work.choose(lighting="direct", drawing="raycast")
    qtbot.waitUntil(lambda: not work._pane_rest.isActive() and window.workspace.is_settled)
    qtbot.wait(100)
    assert trades(builders) == 0
    work.trade.pause(False)
    for azimuth in range(ENOUGH + 2):
        window.state.set_view(View(5.0 * azimuth, 20))
        qtbot.waitUntil(
            lambda: (
                window.workspace.is_settled
                and (work.trade.is_complete or work.trade.scenes >= ENOUGH)
            )
        )
    qtbot.wait(100)
    assert work.trade.scenes == ENOUGH and not work.trade.is_complete
    # Somebody who looks has the present scene measured.
    work.trade.watch(True)
    qtbot.waitUntil(lambda: work.trade.is_complete)
    assert work.trade.scenes == ENOUGH + 1


def test_factors_are_kept_over_runs_and_predict_other_scenes(tmp_path: Path, qtbot: QtBot) -> None:
    store = PreferencesStore(tmp_path / "preferences.json")
    preferences = Preferences(store)
    keeper = TradeKeeper(preferences)
    keeper.follow("volume", "soft")
    # A half takes .2, .3 and .4 of the time, and has two, three and four times the error.
    for n, rest in ((2, AtRest(1.0, 0.01)), (3, AtRest(2.0, 0.02)), (4, AtRest(3.0, 0.03))):
        half = Traded(0.5, 0.1 * n * rest.seconds, n * rest.error)
        keeper.note("raycast", 500.0, rest, (half, Traded(1.0, rest.seconds, 0.0)))
    preferences.finish()
    again = TradeKeeper(Preferences(PreferencesStore(tmp_path / "preferences.json")))
    assert again.expected("raycast", 500.0) == ()
    again.follow("volume", "soft")
    assert again.scenes("raycast", 500.0) == 3
    half, whole = again.expected("raycast", 500.0, AtRest(10.0, 0.005))
    assert (half.scale, half.seconds, half.error) == pytest.approx((0.5, 3.0, 0.015))
    assert (whole.seconds, whole.error) == pytest.approx((10.0, 0.0))
    # Without an image at rest, it is the mean of those that were.
    half, _whole = again.expected("raycast", 500.0)
    assert (half.seconds, half.error) == pytest.approx((0.6, 0.06))
    larger = again.expected("raycast", 600.0)[0]
    assert larger.seconds == pytest.approx(0.6 * 1.44**0.83) and larger.error == half.error
    # An image of twice the width is another one; so are another renderer's and another light's.
    assert again.expected("raycast", 1000.0) == again.expected("vtk", 500.0) == ()
    again.follow("volume", "none")
    assert again.expected("raycast", 500.0) == ()
    # Of a black image nothing is a factor.
    again.note("raycast", 500.0, AtRest(1.0, 0.0), (Traded(1.0, 1.0, 0.0),))
    assert again.expected("raycast", 500.0) == ()


def test_another_machine_has_its_own(tmp_path: Path, qtbot: QtBot) -> None:
    preferences = Preferences()
    keeper = TradeKeeper(preferences)
    keeper.follow("volume", "none")
    keeper.note("raycast", 500.0, AtRest(0.1, 0.01), (Traded(1.0, 0.1, 0.0),))
    (mine,) = preferences.volume("volume").trades
    preferences.note_volume("volume", trades=(replace(mine, machine="another"),))
    assert keeper.expected("raycast", 500.0) == ()
    keeper.note("raycast", 500.0, AtRest(0.1, 0.01), (Traded(1.0, 0.2, 0.0),))
    assert [each.machine for each in preferences.volume("volume").trades] == [
        "another",
        machine_name(),
    ]


def test_path_traced_light_says_when_it_will_be_as_near_as_a_step_asks(
    qtbot: QtBot, make_window: Maker
) -> None:
    trade = rested(qtbot, make_window).workspace.reference.trade
    truth = trade._truth
    assert truth is not None
    # The ray caster's image has no error to become smaller.
    assert trade.at_rest(STEPS[USUAL]) is None

    def refine(samples: int, error: float, seconds: float) -> None:
        quality = replace(truth.request.quality, samples=samples)
        request = replace(truth.request, quality=quality)
        trade._take(replace(truth, request=request, seconds=seconds, image_error=error))

    step = replace(STEPS[USUAL], error=0.005, samples=64)
    refine(1, math.inf, 1.0)
    refine(2, 0.02, 1.0)
    # One error says nothing of the next.
    assert trade.at_rest(step) is None
    refine(4, 0.016, 2.0)
    # What is there is told as it was.
    assert trade.at_rest(replace(step, error=0.016)) == (0.016, 4.0)
    assert trade.at_rest(replace(step, error=0.03)) == (0.02, 2.0)
    # Twice the samples take twice as long, and leave four fifths.
    assert trade.at_rest(replace(step, error=0.011)) == pytest.approx((0.016 * 0.8**2, 16.0))
    # No step has more samples than it may.
    assert trade.at_rest(replace(step, samples=16)) == pytest.approx((0.016 * 0.8**2, 16.0))
    # Another picture begins anew.
    refine(1, math.inf, 1.0)
    assert trade.at_rest(step) is None
