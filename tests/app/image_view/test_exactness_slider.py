import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from rested_window import act_until, follow_pane, rested
from window_fakes import FakeEngine, make_request

from app.engines.pace import SCALES
from app.engines.requests import TradeOffRequest
from app.image_view.exactness_slider import WAITING, FidelityLine
from app.image_view.reference_controls import DIAMETER, REACH, BrightnessSlider, LightBall, light_at
from app.state.reference_choices import ReferenceChoices
from app.state.viewer_state import ViewerState
from model.rendering.brightness import LIT_BRIGHTNESS
from model.rendering.raster import Raster
from model.scene.scene import LightDirection, LightRange
from model.scene.view import View


def test_a_stop_is_chosen_kept_and_drawn_with_its_figures(qtbot, make_window):
    window = make_window(model=None, size=None)
    control, work = window.exactness, window.workspace.reference
    # Where one renderer draws at rest and in motion, samples lie farther apart in motion.
    work.choose(lighting="direct", drawing="raycast")
    assert control.slider.value() == 1
    assert work.settings.sample_distance == 0.5
    # A pane that has just been laid out has its own images drawn.
    follow_pane(qtbot, window)
    # By key, to the last stop.
    QTest.keyClick(control.slider, Qt.Key.Key_End)
    assert work.choices.stop == window.preferences.settings.stop == "exact"
    assert work.settings.sample_distance == 0.25
    assert control.slider.accessibleName() == "From fast to exact: Exact"
    act_until(qtbot, window.reference.resultShown, window.state.move_view, View(40, 20))
    window.state.finish_view()
    qtbot.waitUntil(lambda: "error" in control.figures.text())
    rate, *words, error = control.figures.text().replace(",", "").split()
    assert float(rate) > 0 and words == ["/", "s", "error"]
    # Live images of the fake engine are one level brighter, in one channel of three.
    assert float(error) == pytest.approx(1 / 255 / np.sqrt(3), abs=2e-4)


def request(line, sequence):
    return replace(make_request(sequence), inputs=line._state.inputs)


def test_it_is_there_for_what_is_not_exact_alone(qtbot, pane):
    pane.resize(700, 500)
    pane.show()
    work = SimpleNamespace(raster=Raster(8, 8), settings=None, wanted=None)
    work.choices, work.choicesChanged = ReferenceChoices(), pane.statusShown
    line = FidelityLine(pane, ViewerState(pane), work)
    engine = FakeEngine()
    pane.client.start(lambda: engine, "Loading …")
    assert line.isHidden()
    act_until(qtbot, pane.client.settled, pane.client.submit, request(line, 1))
    assert line.isHidden() and line.fidelity.text == ""
    engine.image_error = 0.0123
    act_until(qtbot, pane.client.settled, pane.client.submit, request(line, 2))
    words = "estimated error .012"
    assert line.fidelity.text == line.text() == line.accessibleName() == words
    assert not line.isHidden()
    assert "1 sample per pixel" in line.toolTip() and "RMSE" in line.toolTip()
    work.wanted = "another renderer"
    pane.statusShown.emit()
    assert line.fidelity.text == "estimated error .012, refining"
    pane._speed, pane._said_at = "moving 9 fps", np.inf  # said just now
    pane.client.fail("It failed.")
    assert line.isHidden() and pane.caption.detail == "failed"


def opened(qtbot, window):
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: bool(window.workspace.reference.trade_off.found))
    return window.exactness.popover


def test_all_stops_are_measured_while_it_is_open(qtbot, make_window, builders):
    window = rested(qtbot, make_window)
    trade_off = window.workspace.reference.trade_off
    engine = builders.references[-1]
    assert not any(isinstance(each, TradeOffRequest) for each in engine.others)
    popover = opened(qtbot, window)
    (asked,) = [each for each in engine.others if isinstance(each, TradeOffRequest)]
    whole = window.workspace.reference.raster
    assert (asked.inputs, asked.quality.pixels) == (window.state.inputs, whole)
    assert [each.scale for each in trade_off.found] == sorted(SCALES)
    errors = [each.error for each in trade_off.found]
    assert errors == sorted(errors, reverse=True) and errors[-1] == 0
    time, error, rest = popover.rows["balanced"]
    assert time.text().endswith(" / s") and error.text()
    assert rest.text() == ".1 voxel steps"
    assert popover.rows["exact"][2].text() == ".05 voxel steps"
    said = popover.status.text()
    assert f"{whole.width} × {whole.height} pixels" in said and "moving" not in said
    # Each stop has the finest image that it has time for, or the fastest.
    seconds = [0.005, 0.02, 0.06, 0.11, 0.3, 0.5]
    pairs = zip(trade_off.found, seconds, strict=True)
    trade_off.found = tuple(replace(each, seconds=s) for each, s in pairs)
    assert {image.seconds: names for image, names in trade_off.stops.items()} == {
        0.02: ["fast"], 0.06: ["balanced"], 0.5: ["exact"],
    }  # fmt: skip
    *coarse, last = trade_off.found
    trade_off.found = *coarse, replace(last, error=0.0054)
    popover.refresh()
    assert "image differs by .0054\nfrom that at rest, which VTK draws" in popover.status.text()
    assert popover.status.sizeHint().width() <= popover.status.width()
    texts = [each for each in popover.plot.items() if isinstance(each, pg.TextItem)]
    marked = {each.toPlainText(): each.pos() for each in texts}
    assert {name: round(10 ** at.x(), 3) for name, at in marked.items()} == {
        "fast": 0.02, "balanced": 0.06, "exact": 0.5,
    }  # fmt: skip
    assert marked["fast"].y() == pytest.approx(trade_off.found[1].error)
    trade_off.found = slow = trade_off.found[0], replace(trade_off.found[1], seconds=0.2)
    assert trade_off.stops == {slow[0]: ["fast", "balanced"], slow[1]: ["exact"]}
    # A disturbed measurement of few pixels is no stop's.
    trade_off.found = replace(slow[0], seconds=0.3), slow[1]
    assert trade_off.stops == {slow[1]: ["fast", "balanced", "exact"]}
    # An edit ends it, and rest begins it anew while it is open.
    window.state.move_view(View(40, 20))
    assert trade_off.found == () and not trade_off.begun
    assert popover.status.text() == WAITING
    window.state.finish_view()
    qtbot.waitUntil(lambda: bool(trade_off.found))
    popover.hide()
    window.state.set_view(View(50, 20))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert trade_off.found == () and not trade_off.begun


def test_an_image_that_fails_ends_it(qtbot, make_window, builders):
    window = rested(qtbot, make_window)
    trade_off = window.workspace.reference.trade_off
    builders.references[-1].error = ValueError("no memory")
    window.exactness.figures.click()
    qtbot.waitUntil(lambda: trade_off.found == () and not trade_off.begun)
    assert not window.errors
    assert window.exactness.popover.status.text() == WAITING


def test_what_is_not_chosen_follows_the_light(qtbot):
    state = ViewerState()
    brightness = state.brightness
    slider = BrightnessSlider(brightness)
    qtbot.addWidget(slider)
    brightness.set_lighting("exact", "direct")
    assert brightness.of("exact") == LIT_BRIGHTNESS and slider.number.text() == "2.00×"
    assert not slider.reset.isEnabled()
    # A model that was trained without light is shown as it is, and changed by the same factor.
    assert brightness.of("learned") == 1
    brightness.set(3.0)
    assert (brightness.of("exact"), brightness.of("learned")) == (3, 1.5)
    brightness.set_lighting("learned", "direct")
    assert brightness.of("learned") == 3
    brightness.set(None)
    brightness.set_lighting("exact", "none")
    assert brightness.of("exact") == 1
    brightness.set(1.0)
    brightness.set_lighting("exact", "soft")
    assert brightness.of("exact") == 1 and slider.reset.isEnabled()
    brightness.set(0.5)
    assert slider.number.text() == ".50×"
    slider.reset.click()
    assert brightness.of("exact") == LIT_BRIGHTNESS


def test_a_drag_is_one_undo_step_and_so_is_a_reset(qtbot, make_window):
    window = make_window()
    brightness, stack = window.brightness, window.state.edits.stack
    slider = BrightnessSlider(brightness)
    qtbot.addWidget(slider)
    usual = brightness.of("exact")
    slider.slider.setSliderDown(True)
    for step in (3, 9, 16):
        slider.slider.setValue(step)
    assert brightness.of("exact") == 4 and stack.count() == 0
    slider.slider.setSliderDown(False)
    assert stack.count() == 1 and stack.undoText() == "brightness"
    slider.reset.click()
    assert brightness.of("exact") == usual and stack.count() == 2
    window.state.edits.undo()
    assert brightness.of("exact") == 4
    window.state.edits.undo()
    assert brightness.of("exact") == usual and brightness.value is None
    window.state.edits.redo()
    assert brightness.of("exact") == 4


def test_the_kind_of_light_is_undone_among_the_edits(window):
    reference, state = window.workspace.reference, window.state
    reference.choose(lighting="direct")
    state.light_input.set(LightDirection(40.0, 20.0))
    reference.choose(lighting="none")
    assert state.light is None and reference.settings.lighting == "none"
    state.edits.undo()
    assert reference.settings.lighting == "direct"
    assert state.light == LightDirection(40.0, 20.0)
    state.edits.undo()
    assert state.light == LightDirection()
    state.edits.undo()
    assert reference.choices.lighting == "auto" and not state.edits.stack.canUndo()
    fingerprint = window.workspace.opened.fingerprint
    assert window.preferences.volume(fingerprint).lighting == "auto"
    # What is kept for no later run is no edit.
    reference.choose(keep=False, lighting="none")
    assert not state.edits.stack.canUndo()


LIMITS = LightRange()


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (-0.6, 0.6), (5.0, 0.0), (0.0, -3.0)])
def test_the_light_shines_straight_onto_the_point_and_stays_in_its_range(x, y):
    light = light_at(x, y, LIMITS)
    if x * x + y * y < 1:
        assert light.towards() == pytest.approx((x, y, math.sqrt(1 - x * x - y * y)), abs=1e-9)
    assert abs(light.azimuth) <= LIMITS.max_azimuth
    assert abs(light.elevation) <= LIMITS.max_elevation


def test_dragging_moves_the_light_live_and_then_finally(qtbot, state):
    state.light_input.set(LightDirection(0.0, 0.0))
    ball, middle = LightBall(state), QPoint(DIAMETER // 2, DIAMETER // 2)
    qtbot.addWidget(ball)
    ball.set_light(LightDirection(), LIMITS)
    ball.show()
    # From anywhere: it is the movement that counts.
    start = middle + QPoint(5, -7)
    qtbot.mousePress(ball, Qt.MouseButton.LeftButton, pos=start)
    assert state.light == LightDirection(0.0, 0.0) and not state.live
    qtbot.mouseMove(ball, start + QPoint(round(REACH / 2), 0))
    assert state.live and state.light is not None
    assert state.light.azimuth == pytest.approx(30, abs=0.5)
    assert state.light.elevation == pytest.approx(0, abs=0.5)
    with qtbot.waitSignal(state.light_input.changeFinished):
        qtbot.mouseRelease(ball, Qt.MouseButton.LeftButton)
    assert not state.live
    qtbot.mouseDClick(ball, Qt.MouseButton.LeftButton)
    assert state.light == LightDirection()
    # A click puts the light there.
    qtbot.mouseClick(ball, Qt.MouseButton.LeftButton, pos=middle - QPoint(0, DIAMETER // 4))
    assert (state.light.azimuth, state.light.elevation) == pytest.approx((0, 28), abs=3)
