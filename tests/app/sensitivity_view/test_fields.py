import threading

import numpy as np
import pytest
from mouse_events import drag, wheel
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from sensitivity_events import asked, hover, over_plot
from window_fakes import FakeEngine

from app.engines.requests import ValueSensitivityRequest, ValueVisibilityRequest
from app.image_view.image_canvas import to_qimage
from app.sensitivity_view.what_if import CLICK_MS
from model.scene.tf_perturbation import edit_over
from model.scene.view import View
from model.sensitivity.display import overlay, scale_of, shown_field


def test_hovering_shows_the_field_with_its_image(qtbot, window, builders):
    hover(window, 140.0)
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    qtbot.waitUntil(lambda: window.generator.canvas.cover is not None)
    qtbot.waitUntil(
        lambda: any(not each.quality.live for each in asked(builders, ValueSensitivityRequest))
    )
    band = window.sensitivity_state.band
    assert band is not None and band.low == pytest.approx(140.0, abs=0.5)
    # The fake's field is the value itself in every pixel.
    edit = edit_over(band.values, (100.0, 200.0), window.sensitivity_state.choices.width)
    inputs = window.state.inputs
    image = window.sensitivity.exact.image_of(inputs)
    field = shown_field(np.full((16, 16, 3), band.low), edit, "signed")
    expected = overlay(image, field, scale_of(field), "signed").astype(np.float32)
    qtbot.waitUntil(lambda: window.reference.canvas.cover == to_qimage(expected))
    assert "exact" in window.sensitivity.exact.caption
    qtbot.waitUntil(lambda: "learned" in window.sensitivity.learned.caption)
    QApplication.sendEvent(window.editor.area.widget.viewport(), QEvent(QEvent.Type.Leave))
    assert window.reference.canvas.cover is None
    assert window.sensitivity.exact.caption == ""


def test_hovering_shows_where_the_value_is_visible_and_with_ctrl_what_an_edit_would_change(
    qtbot, window, builders
):
    state, cover = window.sensitivity_state, window.sensitivity.learned
    hover(window, 140.0, effect=False)
    qtbot.waitUntil(lambda: "part of a pixel that shows" in cover.caption)
    qtbot.waitUntil(lambda: not asked(builders, ValueVisibilityRequest)[-1].quality.live)
    assert not asked(builders, ValueSensitivityRequest)
    band = state.band
    assert band is not None and not band.effect
    # The fake's field is .4 in every pixel.
    image = cover.image_of(window.state.inputs)
    field = np.full((16, 16), (band.low - 100) / 100)
    expected = overlay(image, field, scale_of(field), "visible").astype(np.float32)
    qtbot.waitUntil(lambda: window.generator.canvas.cover == to_qimage(expected))
    # It is the same by any engine: the other image stays as it is.
    assert window.reference.canvas.cover is None
    assert window.sensitivity.result().kind == "region"
    # Ctrl asks the other question where the mouse is.
    QTest.keyPress(window, Qt.Key.Key_Control)
    assert state.band is not None and state.band.effect and state.band.low == band.low
    qtbot.waitUntil(lambda: "slope per" in cover.caption)
    QTest.keyRelease(window, Qt.Key.Key_Control)
    qtbot.waitUntil(lambda: "part of a pixel" in cover.caption)
    # What is kept stays what it is.
    QTest.keyClick(window, Qt.Key.Key_P)
    QTest.keyPress(window, Qt.Key.Key_Control)
    assert state.band is not None and state.band.kept and not state.band.effect
    QTest.keyRelease(window, Qt.Key.Key_Control)


def test_exact_and_learned_fields_have_one_scale(qtbot, window, builders, monkeypatch):
    answer = FakeEngine.value_sensitivity

    def of_the_generator(request, *_):
        return 1.5 * answer(builders.generators[-1], request)

    monkeypatch.setattr(builders.generators[-1], "value_sensitivity", of_the_generator)
    window.sensitivity_state.keep(140.0)
    exact, learned = window.sensitivity.exact, window.sensitivity.learned
    qtbot.waitUntil(lambda: "exact" in exact.caption and "learned" in learned.caption)
    band = window.sensitivity_state.band
    edit = edit_over(band.values, (100.0, 200.0), window.sensitivity_state.choices.width)
    highest = shown_field(np.full((16, 16, 3), 1.5 * 140.0), edit, "signed")
    qtbot.waitUntil(lambda: exact.scale == learned.scale == pytest.approx(scale_of(highest)))


def test_the_wheel_widens_and_a_drag_pins_a_band(qtbot, window):
    viewport, state = window.editor.area.widget.viewport(), window.sensitivity_state
    width = state.choices.width
    wheel(viewport, QPointF(over_plot(window, 150.0)), 2)
    assert state.choices.width == pytest.approx(width * 1.15**2)
    drag(viewport, *(over_plot(window, value, 0.5) for value in (140.0, 150.0, 160.0)))
    assert state.band is not None and state.band.kept
    assert state.band.values == pytest.approx((140.0, 160.0), abs=0.5)
    QApplication.sendEvent(viewport, QEvent(QEvent.Type.Leave))
    hover(window, 110.0)
    assert state.band.values == pytest.approx((140.0, 160.0), abs=0.5)
    qtbot.waitUntil(lambda: window.generator.canvas.cover is not None)
    QTest.keyClick(window, Qt.Key.Key_P)
    assert state.band is None and window.generator.canvas.cover is None
    # Who moves a handle sees the picture.
    (mode, *_) = window.state.transfer_function.opacity.modes
    hover(window, 110.0)
    assert window.sensitivity_state.band is not None
    top = over_plot(window, mode.mean, mode.amplitude)
    drag(viewport, top, over_plot(window, mode.mean + 5, mode.amplitude))
    assert window.state.transfer_function.opacity.modes[0] != mode
    hover(window, 110.0)
    assert window.sensitivity_state.band is None
    # Whoever comes back, or clicks next to the handles, asks again.
    QApplication.sendEvent(viewport, QEvent(QEvent.Type.Leave))
    hover(window, 112.0)
    assert window.sensitivity_state.band is not None


def test_a_field_is_never_over_another_image(qtbot, window, builders):
    window.sensitivity_state.keep(150.0)
    qtbot.waitUntil(lambda: "exact" in window.workspace.sensitivity.fields)
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    analyst = builders.analysts[-1]
    analyst.gate = threading.Semaphore(0)
    window.state.set_view(View(10.0, 5.0))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    qtbot.waitUntil(lambda: window.sensitivity.exact.image_of(window.state.inputs) is not None)
    # The image is there, its field is not: what the pane shows is the last pair, or no field.
    field = window.workspace.sensitivity.fields["exact"]
    assert not field.is_of(window.state.inputs)
    old = window.sensitivity.exact.image_of(field.request.inputs)
    cover = window.reference.canvas.cover
    if cover is not None:
        edit = edit_over((150.0, 150.0), (100.0, 200.0), field.request.width)
        shown = shown_field(field.value, edit, "signed")
        assert cover == to_qimage(overlay(old, shown, scale_of(shown), "signed").astype("f4"))
    drawn = window.sensitivity.visible._curve
    assert drawn.opacity() < 1
    for _ in range(40):
        analyst.gate.release()
    qtbot.waitUntil(lambda: window.workspace.sensitivity.fields["exact"].is_of(window.state.inputs))
    qtbot.waitUntil(lambda: drawn.opacity() == 1)
    analyst.gate = None


def test_a_click_on_the_colour_bar_locks_its_scale(qtbot, window):
    window.sensitivity_state.keep(150.0)
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    scale = window.sensitivity.exact.scale
    QTest.mouseClick(window.sensitivity.learned.bar, Qt.MouseButton.LeftButton)
    assert window.sensitivity_state.choices.locked and window.sensitivity.chips.lock.isChecked()
    window.sensitivity_state.keep(199.0)

    def is_answered():
        field = window.workspace.sensitivity.fields.get("exact")
        return field is not None and field.request.values == (199.0, 199.0)

    qtbot.waitUntil(is_answered)
    assert window.sensitivity.exact.scale == scale


def test_what_if_shows_the_edit_while_the_key_is_held(qtbot, window):
    what_if = window.sensitivity.what_if
    QTest.keyPress(window, Qt.Key.Key_W)
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    qtbot.waitUntil(lambda: window.generator.canvas.cover is not None)
    assert "difference" in window.sensitivity.exact.caption
    # The fake's second image is .1 brighter than the first.
    assert "exact changes by .1" in what_if.result
    assert "learned changes by .1" in what_if.result
    # Without a band, the mode is at the first value of the list.
    value = window.sensitivity.responses.peaks.intervals[0].value
    tried = float(what_if.result.removeprefix("At ").partition(":")[0])
    assert tried == pytest.approx(value, abs=0.5)
    QTest.keyRelease(window, Qt.Key.Key_W)
    assert window.reference.canvas.cover is None
    # After a short press nothing is covered.
    QTest.keyClick(window, Qt.Key.Key_W)
    qtbot.waitUntil(lambda: "learned changes" in window.sensitivity.what_if.result)
    assert window.generator.canvas.cover is None


def test_what_if_says_nothing_of_what_is_no_longer_asked(qtbot, window):
    what_if, state = window.sensitivity.what_if, window.sensitivity_state
    what_if.start()
    state.choose(shown=False)
    # Its answers are on their way by then.
    qtbot.waitUntil(lambda: not what_if._channels.is_pending)
    assert what_if.result == ""
    qtbot.waitUntil(lambda: not what_if.is_on)
    assert window.reference.canvas.cover is None


def test_a_click_on_what_if_lasts_until_the_next_one(qtbot, window):
    button, exact = window.sensitivity.what_if.button, window.reference.canvas
    button.click()
    qtbot.waitUntil(lambda: exact.cover is not None)
    assert button.isChecked()
    button.click()
    assert exact.cover is None and not button.isChecked()
    button.click()
    qtbot.waitUntil(lambda: exact.cover is not None)
    window.state.set_view(View(80.0))
    assert not button.isChecked()
    QTest.mousePress(button, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: button._held.hasExpired(CLICK_MS))
    QTest.mouseRelease(button, Qt.MouseButton.LeftButton)
    assert exact.cover is None and not button.isChecked()
    # It follows the mouse while it is on.
    what_if, state = window.sensitivity.what_if, window.sensitivity_state
    qtbot.waitUntil(button.isEnabled)
    button.click()
    qtbot.waitUntil(lambda: "exact changes" in what_if.result)
    state.hover(170.0)
    # The bin that is nearest to it.
    qtbot.waitUntil(lambda: what_if.result.startswith("At 169.8"))
    qtbot.waitUntil(lambda: "exact changes" in what_if.result)
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not what_if.button.isChecked()
    # What was said of one value does not stay next to another.
    state.hover(120.0)
    assert what_if.result == ""
    state.hover(None)
    # It ends where the view turns, or another window comes.
    for end in (
        lambda: window.state.set_view(View(120.0, 5.0)),
        lambda: QApplication.sendEvent(window, QEvent(QEvent.Type.ActivationChange)),
    ):
        qtbot.waitUntil(window.sensitivity.what_if.button.isEnabled)
        qtbot.waitUntil(lambda: window.workspace.is_settled)
        QTest.keyPress(window, Qt.Key.Key_W)
        qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
        window.isActiveWindow = lambda: False
        end()
        assert window.reference.canvas.cover is None
        QTest.keyRelease(window, Qt.Key.Key_W)
