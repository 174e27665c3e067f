from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from pytestqt.qtbot import QtBot
from rested_window import rested
from window_fakes import FakeBuilders

from app.engines.exactness import STOPS
from app.engines.pace import SCALES
from app.engines.requests import TradeRequest
from app.image_view.exactness_slider import WAITING, TradePopover
from app.window.main_window import MainWindow
from model.scene.view import View

Maker = Callable[..., MainWindow]


def opened(qtbot: QtBot, window: MainWindow) -> TradePopover:
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: bool(window.workspace.reference.trade.found))
    return window.exactness.popover


def test_all_stops_are_measured_while_it_is_open(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    engine = builders.references[-1]
    assert not any(isinstance(each, TradeRequest) for each in engine.others)
    popover = opened(qtbot, window)
    (asked,) = [each for each in engine.others if isinstance(each, TradeRequest)]
    whole = window.workspace.reference.whole_raster()
    assert (asked.inputs, asked.quality.pixels) == (window.state.inputs, whole)
    assert [each.scale for each in trade.found] == sorted(SCALES)
    errors = [each.error for each in trade.found]
    assert errors == sorted(errors, reverse=True) and errors[-1] == 0
    time, error, rest = popover.rows["balanced"]
    assert time.text().endswith(" / s") and error.text()
    assert rest.text() == ".1 voxel steps"
    assert popover.rows["exact"][2].text() == ".05 voxel steps"
    assert f"{whole.width} x {whole.height} pixels" in popover.status.text()
    # Each stop has the finest image that it has time for, or the fastest.
    seconds = [0.005, 0.02, 0.06, 0.11, 0.3, 0.5]
    trade.found = tuple(
        replace(each, seconds=s) for each, s in zip(trade.found, seconds, strict=True)
    )
    chosen = [trade.at(stop) for stop in STOPS.values()]
    assert [each and each.seconds for each in chosen] == [0.02, 0.06, 0.5]
    popover.refresh()
    assert "same" not in popover.status.text()
    # Where all pixels are there in time, the stops are the same, and it says so.
    whole_found = trade.found
    for slowest, words in ((0.06, "Balanced and Exact are"), (0.02, "All stops are")):
        trade.found = tuple(replace(each, seconds=slowest) for each in whole_found)
        popover.refresh()
        assert words in popover.status.text()
    trade.found = whole_found
    assert trade.at(replace(STOPS["fast"], live_seconds=0.001)) == trade.found[0]
    # An edit ends it, and rest begins it anew while it is open.
    window.state.move_view(View(40, 20))
    assert trade.found == () and not trade.begun
    assert popover.status.text() == WAITING
    window.state.finish_view()
    qtbot.waitUntil(lambda: bool(trade.found))
    popover.hide()
    window.state.set_view(View(50, 20))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert trade.found == () and not trade.begun


def test_an_image_that_fails_ends_it(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    builders.references[-1].error = ValueError("no memory")
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: trade.found == () and not trade.begun)
    assert window.reference.client.error is None
    assert window.exactness.popover.status.text() == WAITING
