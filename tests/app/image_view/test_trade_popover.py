from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from pytestqt.qtbot import QtBot
from rested_window import rested
from window_fakes import FakeBuilders, red_of

from app.image_view.trade_popover import WAITING, TradePopover
from app.state.exactness import STOPS
from app.state.pace import SCALES
from app.window.main_window import MainWindow
from model.scene.view import View

Maker = Callable[..., MainWindow]


def opened(qtbot: QtBot, window: MainWindow) -> TradePopover:
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: window.workspace.reference.trade.is_complete)
    return window.exactness.popover


def test_all_stops_are_measured_while_it_is_open(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    engine = builders.references[-1]
    assert not any(each.is_measured for each in engine.requests)
    before = window.reference.client.description
    popover = opened(qtbot, window)
    asked = [each for each in engine.requests if each.is_measured]
    # The fewest pixels come first.
    whole = window.workspace.reference.whole_raster()
    widths = [each.quality.pixels.width for each in asked]
    assert widths == [whole.scaled(s).width for s in sorted(SCALES)]
    # They are given up for what is asked for meanwhile.
    assert not any(each.quality.live for each in asked)
    # Red tells the number of pixels, so errors are known.
    truth = engine.requests[engine.requests.index(asked[0]) - 1]
    for request, found in zip(asked, trade.found, strict=True):
        gap = abs(red_of(request) - red_of(truth)) / 255 / np.sqrt(3)
        assert found.error == pytest.approx(gap, abs=1e-6)
        assert found.seconds > 0
    assert window.reference.client.description == before
    time, error, rest = popover.rows["balanced"]
    assert time.text().endswith(" ms") and error.text()
    assert rest.text() == ".1 voxel steps"
    assert popover.rows["exact"][2].text() == ".05 voxel steps"
    assert f"{whole.width} x {whole.height} pixels" in popover.status.text()
    # Each stop has the finest image that it has time for, or the fastest.
    seconds = [0.005, 0.02, 0.06, 0.11, 0.3, 0.5]
    trade.found = tuple(
        replace(each, seconds=s) for each, s in zip(trade.found, seconds, strict=True)
    )
    chosen = [trade.at(stop) for stop in STOPS.values()]
    assert [each and each.seconds for each in chosen] == [0.005, 0.06, 0.11]
    assert trade.at(replace(STOPS["fast"], live_seconds=0.001)) == trade.found[0]
    # An edit ends it, and rest begins it anew while it is open.
    window.state.move_view(View(40, 20))
    assert trade.found == () and not trade.is_measuring
    assert popover.status.text() == WAITING
    window.state.finish_view()
    qtbot.waitUntil(lambda: trade.is_complete)
    popover.hide()
    window.state.set_view(View(50, 20))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert trade.found == () and not trade.is_measuring


def test_an_image_that_fails_ends_it(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    builders.references[-1].error = ValueError("no memory")
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: trade.found == () and not trade.is_measuring)
    assert window.reference.client.error is None
    assert window.exactness.popover.status.text() == WAITING
