from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot
from rested_window import rested
from window_fakes import FakeBuilders, red_of

from app.image_view.trade_popover import WAITING, TradePopover
from app.state.exactness import STEPS, USUAL
from app.state.pace import SCALES
from app.window.main_window import MainWindow
from model.scene.view import View

Maker = Callable[..., MainWindow]


def opened(qtbot: QtBot, window: MainWindow) -> TradePopover:
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: window.workspace.reference.trade.is_complete)
    return window.exactness.popover


def test_all_steps_are_measured_once_it_is_open(
    qtbot: QtBot, make_window: Maker, builders: FakeBuilders
) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    engine = builders.references[-1]
    assert not any(each.is_measured for each in engine.requests)
    before = window.reference.client.description
    popover = opened(qtbot, window)
    asked = [each for each in engine.requests if each.is_measured]
    # As quick as they are, each is drawn twice, and once more where something else came first;
    # the fewest pixels come first.
    widths = [each.quality.pixels.width for each in asked]
    whole = window.workspace.reference.whole_raster()
    assert list(dict.fromkeys(widths)) == [whole.scaled(s).width for s in sorted(SCALES)]
    last = {each.quality.pixels.width: each for each in asked}
    assert min(map(widths.count, last)) == 2
    # They are given up for what is asked for meanwhile.
    assert not any(each.quality.live for each in asked)
    # Red tells the number of pixels, so errors are known.
    truth = engine.requests[engine.requests.index(asked[0]) - 1]
    for request, found in zip(last.values(), trade.found, strict=True):
        gap = abs(red_of(request) - red_of(truth)) / 255 / np.sqrt(3)
        assert found.error == pytest.approx(gap, abs=1e-6)
        assert found.seconds > 0
    assert window.reference.client.description == before
    name, time, error, rest = popover.rows[USUAL]
    assert name.text() == "Balanced, up to 100 ms" and name.isChecked()
    assert time.text().endswith(" ms") and error.text()
    assert rest.text() == ".1 voxel steps" and popover.rows[-1][3].text() == ".05 voxel steps"
    assert f"{whole.width} x {whole.height} pixels" in popover.status.text()


def test_a_step_has_the_finest_image_within_its_time(qtbot: QtBot, make_window: Maker) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    opened(qtbot, window)
    seconds = [0.005, 0.02, 0.06, 0.11, 0.3, 0.5]
    trade.found = tuple(
        replace(each, seconds=s) for each, s in zip(trade.found, seconds, strict=True)
    )
    found = [trade.at(step) for step in STEPS]
    assert [each and each.seconds for each in found] == [0.005, 0.02, 0.06, 0.11, 0.11]
    slow = replace(STEPS[0], live_seconds=0.001)
    assert trade.at(slow) == trade.found[0]


def test_a_click_on_a_row_or_in_the_plot_takes_a_step(qtbot: QtBot, make_window: Maker) -> None:
    window = rested(qtbot, make_window)
    popover = opened(qtbot, window)
    work = window.workspace.reference
    popover.rows[0][0].click()
    assert work.choices.exactness == window.exactness.slider.value() == 0
    view = popover.plot.getPlotItem().vb
    # The place of 150 milliseconds.
    place = view.mapViewToScene(QPointF(np.log10(150), view.viewRange()[1][0] + 0.1))
    at = popover.plot.mapFromScene(place)
    QTest.mouseClick(popover.plot.viewport(), Qt.MouseButton.LeftButton, pos=at)
    qtbot.waitUntil(lambda: work.choices.exactness == 3)
    assert popover.rows[3][0].isChecked()


def test_an_edit_ends_it_and_rest_begins_it_anew(qtbot: QtBot, make_window: Maker) -> None:
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    popover = opened(qtbot, window)
    window.state.move_view(View(40, 20))
    assert trade.found == () and not trade.is_measuring
    # Meanwhile it says what the scene before it has taught.
    assert popover.status.text().startswith(f"{WAITING}\n~ is predicted by another scene")
    assert popover.rows[0][1].text().startswith("~")
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


def test_it_says_how_near_answers_were_while_something_moved(
    qtbot: QtBot, make_window: Maker
) -> None:
    window = rested(qtbot, make_window)
    errors = window.workspace.live_errors
    popover = opened(qtbot, window)
    assert not popover.answers.isVisibleTo(popover)
    for azimuth in (31.0, 32.0):
        window.state.move_view(View(azimuth, 20.0))
        qtbot.wait(50)
    window.state.finish_view()
    qtbot.waitUntil(lambda: "curve" in errors.found)
    assert "Sensitivity curve, while it moved: " in popover.answers.text()
    assert ", cosine " in popover.answers.text()
    assert popover.answers.isVisibleTo(popover)
