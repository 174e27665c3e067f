from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from rested_window import act_until, rested
from window_fakes import FakeEngine, make_request

from app.engines.exactness import STOPS, USUAL
from app.engines.pace import SCALES
from app.engines.requests import TradeRequest
from app.image_view.exactness_slider import WAITING, FidelityLine
from app.state.reference_choices import ReferenceChoices
from app.state.viewer_state import ViewerState
from model.rendering.raster import Raster
from model.scene.view import View


def test_a_stop_is_chosen_kept_and_drawn_with_its_figures(qtbot, make_window):
    window = make_window(model=None, size=None)
    control, work = window.exactness, window.workspace.reference
    # Where one renderer draws at rest and in motion, samples lie farther apart in motion.
    work.choose(lighting="direct", drawing="raycast")
    assert control.slider.value() == 1
    assert control.slider.accessibleName() == "From fast to exact: Balanced"
    assert "up to 12 / s" in control.slider.toolTip()
    assert work.settings.sample_distance == 0.5
    # A pane that has just been laid out has its own images drawn.
    qtbot.waitUntil(lambda: not work._pane_rest.isActive() and window.workspace.is_settled)
    # By key, to the last stop.
    QTest.keyClick(control.slider, Qt.Key.Key_End)
    assert work.choices.stop == window.preferences.settings.stop == "exact"
    assert work.settings.sample_distance == 0.25
    assert control.slider.accessibleName() == "From fast to exact: Exact"
    qtbot.waitUntil(lambda: "error" in control.figures.text(), timeout=10_000)
    rate, *words, error = control.figures.text().replace(",", "").split()
    assert float(rate) > 0 and words == ["/", "s", "error"]
    # Live images of the fake engine are one level brighter, in one channel of three.
    assert float(error) == pytest.approx(1 / 255 / np.sqrt(3), abs=2e-4)
    assert control.figures.accessibleName() == f"Moving images: {control.figures.text()}"


@pytest.mark.parametrize(("lighting", "exact"), [("none", 0.25), ("path", 0.5)])
def test_in_path_traced_light_samples_stay_apart(lighting, exact):
    for stop, distance in (("fast", 0.5), (USUAL, 0.5), ("exact", exact)):
        choices = ReferenceChoices(lighting=lighting, stop=stop)
        assert choices.settings(None).sample_distance == distance


@pytest.fixture
def line(pane):
    pane.resize(700, 500)
    pane.show()
    return FidelityLine(pane, ViewerState(pane), lambda: Raster(8, 8), lambda: False)


def request(line, sequence):
    return replace(make_request(sequence), inputs=line._state.inputs)


def test_it_is_there_for_what_is_not_exact_alone(qtbot, line):
    pane, engine = line._pane, FakeEngine()
    pane.client.start(lambda: engine, "Loading …")
    assert line.isHidden()
    act_until(qtbot, pane.client.settled, pane.client.submit, request(line, 1))
    assert line.isHidden() and line.said == ""
    engine.image_error = 0.0123
    act_until(qtbot, pane.client.settled, pane.client.submit, request(line, 2))
    words = "error .012"
    assert not line.isHidden() and line.said == line.text() == line.accessibleName() == words
    assert "1 sample per pixel" in line.toolTip() and "RMSE" in line.toolTip()
    line._passes = lambda: True
    pane.statusShown.emit()
    assert line.said == "error .012, refining"
    # In the upper right corner, below the caption.
    assert line.geometry().right() <= pane.canvas.width() and line.y() > pane.caption.y()
    # Neither of a picture that covers the image, nor of an error.
    pane.name_cover("Preview")
    assert line.isHidden()
    pane.name_cover("")
    assert not line.isHidden()
    pane.client.fail("It failed.")
    assert line.isHidden()


def opened(qtbot, window):
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: bool(window.workspace.reference.trade.found))
    return window.exactness.popover


def test_all_stops_are_measured_while_it_is_open(qtbot, make_window, builders):
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    engine = builders.references[-1]
    assert not any(isinstance(each, TradeRequest) for each in engine.others)
    popover = opened(qtbot, window)
    (asked,) = [each for each in engine.others if isinstance(each, TradeRequest)]
    whole = window.workspace.reference.raster
    assert (asked.inputs, asked.quality.pixels) == (window.state.inputs, whole)
    assert [each.scale for each in trade.found] == sorted(SCALES)
    errors = [each.error for each in trade.found]
    assert errors == sorted(errors, reverse=True) and errors[-1] == 0
    time, error, rest = popover.rows["balanced"]
    assert time.text().endswith(" / s") and error.text()
    assert rest.text() == ".1 voxel steps"
    assert popover.rows["exact"][2].text() == ".05 voxel steps"
    assert f"{whole.width} × {whole.height} pixels" in popover.status.text()
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


def test_an_image_that_fails_ends_it(qtbot, make_window, builders):
    window = rested(qtbot, make_window)
    trade = window.workspace.reference.trade
    builders.references[-1].error = ValueError("no memory")
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: trade.found == () and not trade.begun)
    assert window.reference.client.error is None
    assert window.exactness.popover.status.text() == WAITING
