import re
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mouse_events import at, drag, pixel, wheel
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog
from ramp import make_tf, make_volume
from rested_window import act_until
from sensitivity_events import asked, hover
from window_fakes import FakeEngine

from app.engines.requests import ValueSensitivityRequest, ValueVisibilityRequest
from app.image_view.image_canvas import to_qimage
from app.window.main_window import MainWindow
from model.errors import RenderError
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.tf_emphasis import STRIKING_COLORS
from model.scene.tf_perturbation import edit_around, edit_over
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity.display import overlay, scale_of, shown_field, shown_responses
from model.sensitivity.what_if import edited


def test_both_engines_answer_as_soon_as_a_volume_is_open(window):
    responses = window.sensitivity.responses
    window.sensitivity_state.show_layer("curve", True)
    expected = shown_responses(
        256 * np.exp(-((np.arange(256) - 100) ** 2) / 200),
        256,
        window.sensitivity_state.choices.width,
    )
    for name in ("exact", "learned"):
        np.testing.assert_allclose(responses.curves[name].heights, expected, rtol=1e-5, atol=1e-9)
    assert "agrees well, cosine 1" in window.sensitivity.source.plain_text
    (interval,) = responses.peaks.intervals
    assert interval.value == pytest.approx(100 + 100 * 100 / 255)
    assert window.sensitivity.findings.edit_rows[0].accessibleName().startswith("139.2 K ")


def test_escape_ends_one_thing_after_the_other(window):
    state = window.sensitivity_state
    state.pick((0.5, 0.5))
    state.keep(140.0)
    state.set_tool("lasso")
    for left in (state.tool, state.band, state.place):
        assert left is not None
        QTest.keyClick(window.reference.canvas, Qt.Key.Key_Escape)
    assert (state.tool, state.band, state.place) == (None, None, None)
    assert not window.sensitivity.escape()
    # A double click asks for no values.
    canvas = window.reference.canvas
    where = at(canvas, 0.5, 0.5)
    QTest.mouseClick(canvas, Qt.MouseButton.LeftButton, pos=where)
    QTest.mouseDClick(canvas, Qt.MouseButton.LeftButton, pos=where)
    QTest.mouseRelease(canvas, Qt.MouseButton.LeftButton, pos=where)
    assert state.place is None and window.state.view == window.state.home


def test_an_error_is_said_and_forgotten(qtbot, window, builders):
    analyst = builders.analysts[-1]
    analyst.error = RenderError("Out of order; wait.")
    window.sensitivity_state.show_layer("curve", True)
    window.sensitivity_state.activate(None)
    qtbot.waitUntil(lambda: "Out of order" in window.sensitivity.source.plain_text)
    assert not window.sensitivity.responses.curves["exact"].isVisible()
    analyst.error = None
    window.sensitivity_state.activate(None)
    qtbot.waitUntil(lambda: "Out of order" not in window.sensitivity.source.plain_text)
    qtbot.waitUntil(lambda: window.sensitivity.responses.curves["exact"].isVisible())


def test_another_volume_forgets_the_answers(qtbot, window, builders):
    window.sensitivity_state.keep(150.0)
    window.sensitivity_state.pick((0.5, 0.5))
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    old = builders.analysts[-1]
    builders.volumes["other"] = make_volume("other", 500.0)
    act_until(qtbot, window.workspace.volumeOpened, window.workspace.opening.open, Path("other"))
    assert window.sensitivity_state.band is window.sensitivity_state.place is None
    assert window.reference.canvas.cover is None
    qtbot.waitUntil(lambda: old.closed)
    asker = window.workspace.sensitivity
    qtbot.waitUntil(lambda: "exact" in asker.regions)
    assert "learned" not in asker.regions
    assert asker.regions["exact"].request.inputs.opacity_tf.scalar_range == (100.0, 500.0)
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    # Regions stay for the next time step, and go with another shape.
    state, region = window.sensitivity_state, Outline.rectangle(0.2, 0.3, 0.6, 0.7)
    state.add_region(region)
    builders.volumes["ramp 2"] = make_volume("ramp 2", 500.0)
    builders.volumes["flat"] = Volume(make_volume("other").voxels[:, :, :3], name="flat")
    for name, outline in (("ramp 2", region), ("flat", Outline())):
        act_until(qtbot, window.workspace.volumeOpened, window.workspace.opening.open, Path(name))
        assert state.outline == outline
    assert window.sensitivity.chips.region.caption == "Whole image ▾"
    qtbot.waitUntil(lambda: window.workspace.is_settled)


def test_a_flag_adds_the_mode_that_was_listed_or_one_in_a_striking_colour(qtbot, window):
    before = window.state.transfer_function
    responses, height = window.sensitivity.responses, window.sensitivity_state.choices.height
    # What changes less than can be shown is not listed.
    window.sensitivity_state.choose(height=1e-6)
    assert not responses.peaks.intervals
    window.sensitivity_state.choose(height=height)
    (interval,) = responses.peaks.intervals
    for background, said in (("white", "> +.5 over black"), ("black", "brighter by > .5")):
        window.overlays.choose_background(background)
        assert window.sensitivity.findings.edit_rows[0].accessibleName().endswith(said)
    flag = window.sensitivity.responses.flags[0]
    QTest.mouseClick(flag, Qt.MouseButton.LeftButton)
    tf = window.state.transfer_function
    mode = tf.opacity.modes[-1]
    assert len(tf.opacity.modes) == len(before.opacity.modes) + 1
    assert mode.mean == pytest.approx(interval.value)
    assert mode.amplitude == pytest.approx(window.sensitivity_state.choices.height)
    assert tf.color == before.color
    # It is the edit whose change is listed.
    inputs, width = window.state.inputs, window.sensitivity_state.choices.width
    edit = edit_around(interval.value, before.scalar_range, width)
    unedited = SceneInputs.of(inputs.view, before, light=inputs.light)
    listed = edited(unedited, edit, mode.amplitude).opacity_tf.sample()
    np.testing.assert_allclose(tf.opacity.sample(), listed, atol=0.01)
    # At once again: the answer is about the image before.
    QTest.mouseClick(flag, Qt.MouseButton.LeftButton)
    window.sensitivity.findings.edit_rows[0].buttons[0].click()
    assert window.state.transfer_function == tf
    window.state.edits.undo()
    assert window.state.transfer_function == before
    qtbot.waitUntil(window.sensitivity.findings.edit_rows[0].buttons[0].isEnabled)
    window.sensitivity.findings.edit_rows[0].buttons[0].click()
    assert window.state.transfer_function == tf
    window.state.edits.undo()
    qtbot.waitUntil(window.sensitivity.findings.edit_rows[0].buttons[0].isEnabled)
    (other,) = window.sensitivity.findings.edit_rows[0].buttons[0].menu().actions()
    other.trigger()
    striking = window.state.transfer_function
    assert striking.opacity == tf.opacity
    colors = [pytest.approx(color, abs=0.02) for color in STRIKING_COLORS]
    assert tuple(striking.color(mode.mean)) in colors


def test_two_clicks_on_add_mean_the_same_value(qtbot, window, monkeypatch):
    findings, tf_input = window.sensitivity.findings, window.state.tf_input

    def response(self, request, watch):
        # A mode at bin 100 makes further ones there weaker than one at bin 180.
        strength = 3.0 if request.inputs.opacity_tf == start.opacity else 0.5
        bins = np.arange(256)
        return sum(
            much * np.exp(-((bins - middle) ** 2) / 200)
            for much, middle in ((strength, 100), (1.0, 180))
        ).astype(np.float32)

    monkeypatch.setattr(FakeEngine, "region_sensitivity", response)
    window.sensitivity_state.open_panel()
    start = make_tf(150.0)
    tf_input.set(start)
    rows, means = findings.edit_rows, []
    qtbot.waitUntil(rows[1].isVisible)
    for _ in range(2):
        qtbot.waitUntil(rows[0].buttons[0].isEnabled)
        rows[0].buttons[0].click()
        means.append(window.state.transfer_function.opacity.modes[-1].mean)
    assert means[0] == means[1] == pytest.approx(100 + 100 * 100 / 255)
    qtbot.waitUntil(rows[0].buttons[0].isEnabled)
    QApplication.sendEvent(findings, QEvent(QEvent.Type.Leave))
    assert [each.accessibleName()[:7] for each in rows[:2]] == ["170.6 K", "139.2 K"]
    # A drag elsewhere asks for the present order, too: the mouse may have left by the menu.
    rows[0].buttons[0].click()
    qtbot.waitUntil(rows[0].buttons[0].isEnabled)
    tf_input.move(start)
    qtbot.waitUntil(lambda: not window.sensitivity.responses.holds)
    tf_input.finish("drag")
    qtbot.waitUntil(lambda: rows[0].accessibleName().startswith("139.2 K"))


def test_rows_of_values_stay_while_they_are_under_the_mouse(qtbot, window, monkeypatch):
    findings, asker = window.sensitivity.findings, window.workspace.sensitivity
    window.sensitivity_state.open_panel()
    qtbot.waitUntil(lambda: asker.visibility is not None)

    def rows(*middles):
        seen = sum(np.exp(-((np.arange(256) - each) ** 2) / 50) for each in middles)
        asker.visibility = replace(asker.visibility, value=np.float32(seen / seen.sum())[None])
        findings.refresh()
        return [row.accessibleName() for row in findings.value_rows if not row.isHidden()]

    both = rows(80, 180)
    monkeypatch.setattr(findings, "underMouse", lambda: True)
    assert len(both) == len(rows(180)) == 2
    monkeypatch.undo()
    QApplication.sendEvent(findings, QEvent(QEvent.Type.Leave))
    assert len(rows(180)) == 1


def test_switched_off_nothing_is_asked_or_shown(qtbot, window, builders):
    window.sensitivity_state.keep(150.0)
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    QTest.keyClick(window, Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)
    assert not window.sensitivity_state.choices.shown
    assert window.reference.canvas.cover is None and window.sensitivity.findings.isHidden()
    asked = []
    builders.analysts[-1].others, builders.generators[-1].others = asked, asked
    window.state.tf_input.set(make_tf(150.0), "test")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    QTest.mouseClick(window.reference.canvas, Qt.MouseButton.LeftButton, pos=QPoint(60, 60))
    assert all(label.isHidden() for label in window.sensitivity.labels)
    # Of what was asked before, some may still be answered.
    assert not [request for request in asked if request.inputs == window.state.inputs]
    # A button that is grey says why.
    button = window.sensitivity.what_if.button
    assert not button.isEnabled()
    assert button.toolTip().startswith("Choose Region > Show sensitivity first")


def test_outside_what_the_model_was_trained_on_is_marked(qtbot, window):
    assert "outside" not in window.sensitivity.source.plain_text
    window.state.set_view(replace(window.state.view, elevation=88.0))
    window.state.set_view(replace(window.state.view, roll=170.0))
    assert "outside what it was trained on" in window.sensitivity.source.plain_text
    window.sensitivity_state.keep(150.0)
    qtbot.waitUntil(lambda: "learned, outside" in window.sensitivity.learned.caption)
    # Until the exact field is there, the learned one is shown in both panes.
    qtbot.waitUntil(lambda: "exact" in window.sensitivity.exact.caption)
    assert "outside" not in window.sensitivity.exact.caption


def test_what_is_shown_is_saved_as_figure_and_numbers(
    qtbot, window, builders, tmp_path, monkeypatch
):
    def choose(name):
        monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / name), ""))
        window.files.save_sensitivity(window.sensitivity.result())

    choose("region")
    assert (tmp_path / "region.png").stat().st_size > 2000
    choose("region.csv")
    assert (tmp_path / "region.csv").read_text().count("\n") == 257
    window.sensitivity_state.keep(150.0)
    asker = window.workspace.sensitivity
    qtbot.waitUntil(lambda: asker.field is not None)
    choose("value.npz")
    with np.load(tmp_path / "value.npz") as file:
        assert file["sensitivity"].shape[2] == 3
        np.testing.assert_allclose(file["opacity"], window.state.transfer_function.opacity.sample())
    choose("value.png")
    assert window.notice.text == ""
    window.sensitivity_state.choose(shown=False)
    choose("nothing.png")
    assert "no sensitivity" in window.notice.text
    # A field of another band is not saved.
    window.sensitivity_state.choose(shown=True)
    window.sensitivity_state.keep(120.0)
    qtbot.waitUntil(lambda: window.sensitivity.result() is not None)
    found = window.sensitivity.result()
    assert found is not None and found.place == "edits around 120 K"
    builders.analysts[-1].gate = threading.Semaphore(0)
    window.sensitivity_state.choose(engine="exact")
    window.sensitivity_state.keep(180.0)
    assert window.sensitivity.result() is None
    builders.analysts[-1].gate.release(40)
    qtbot.waitUntil(lambda: window.sensitivity.result() is not None)
    builders.analysts[-1].gate = None


def test_keys_and_buttons_without_a_volume_do_no_harm(qtbot, builders):
    window = MainWindow(builders.make())
    qtbot.addWidget(window)
    window.show()
    for key in (Qt.Key.Key_W, Qt.Key.Key_P, Qt.Key.Key_R, Qt.Key.Key_L):
        QTest.keyClick(window, key)
    drag(window.generator.canvas, QPoint(30, 30), QPoint(60, 60), QPoint(90, 90))
    view = window.sensitivity
    adds = [row.buttons[0] for row in view.findings.edit_rows]
    for button in (view.what_if.button, view.band.tag.add, *adds):
        button.click()
    assert window.sensitivity.result() is None
    window.close()


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
    window.sensitivity_state.hover(140.0, effect=False)
    # The tag has the values of the band on the plot, up to half of the edit's height.
    half = window.sensitivity_state.choices.width * 100 / 255 * np.sqrt(2 * np.log(2))
    low, high = re.findall(r"\d+\.?\d*", window.sensitivity.band.tag.text.text())[:2]
    assert (float(low), float(high)) == pytest.approx((140 - half, 140 + half), abs=0.6)


def test_hovering_shows_where_the_value_is_visible_and_with_ctrl_what_an_edit_would_change(
    qtbot, window, builders, monkeypatch
):
    state, cover = window.sensitivity_state, window.sensitivity.learned
    hover(window, 140.0, effect=False)
    qtbot.waitUntil(lambda: "part of a pixel that shows" in cover.caption)
    qtbot.waitUntil(lambda: not asked(builders, ValueVisibilityRequest)[-1].quality.live)
    assert not asked(builders, ValueSensitivityRequest)
    band = state.band
    assert band is not None and not band.effect
    # The fake's field is .4 in every pixel.
    field = np.full((16, 16), (band.low - 100) / 100)

    def expected():
        """Over the newest image: on a busy machine, it may be drawn once more."""
        image = cover.image_of(window.state.inputs)
        return to_qimage(overlay(image, field, scale_of(field), "visible").astype(np.float32))

    qtbot.waitUntil(lambda: window.generator.canvas.cover == expected())
    # It is the same by any engine: the other image stays as it is, and the caption names none.
    qtbot.waitUntil(lambda: window.generator.caption.detail == "")
    assert window.reference.canvas.cover is None
    assert window.sensitivity.result().kind == "region"
    # Ctrl asks the other question where the mouse is.
    QTest.keyPress(window, Qt.Key.Key_Control)
    assert state.band is not None and state.band.effect and state.band.low == band.low
    qtbot.waitUntil(lambda: "opacity rises" in cover.caption)
    QTest.keyRelease(window, Qt.Key.Key_Control)
    qtbot.waitUntil(lambda: "part of a pixel" in cover.caption)
    assert cover.bar.accessibleName() == "Colours: 0 to 40 % of the pixel"

    def with_a_fleck(_engine, request, *_):
        field = np.full(request.quality.pixels.shape, 0.2)
        field[8, 8] = 0.6
        return field

    # One pixel does not set the scale: the bar says that full colour is also beyond its end.
    monkeypatch.setattr(FakeEngine, "value_visibility", with_a_fleck)
    hover(window, 150.0, effect=False)
    qtbot.waitUntil(lambda: cover.bar.accessibleName().startswith("Colours: 0 to ≥ "))
    assert cover.caption.startswith("≥ ")


def test_exact_and_learned_fields_have_one_scale_which_a_click_on_the_bar_locks(
    qtbot, window, builders, monkeypatch
):
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
    scale = exact.scale
    QTest.mouseClick(learned.bar, Qt.MouseButton.LeftButton)
    assert window.sensitivity_state.choices.locked and window.sensitivity.chips.lock.isChecked()
    window.sensitivity_state.keep(199.0)

    def is_answered():
        field = window.workspace.sensitivity.fields.get("exact")
        return field is not None and field.request.values == (199.0, 199.0)

    qtbot.waitUntil(is_answered)
    assert exact.scale == scale
    # The generator's field is beyond the locked scale.
    qtbot.waitUntil(lambda: learned.caption.startswith("≥ ") and not exact.caption.startswith("≥"))
    assert re.match("Colours: ≤ −.* to ≥ [+]", learned.bar.accessibleName())


def test_the_wheel_widens_and_a_drag_pins_a_band(qtbot, window):
    viewport, state = window.editor.area.widget.viewport(), window.sensitivity_state
    width = state.choices.width
    wheel(viewport, QPointF(pixel(window.editor, 150.0, 0.8)), 2)
    assert state.choices.width == pytest.approx(width * 1.15**2)
    drag(viewport, *(pixel(window.editor, value, 0.5) for value in (140.0, 150.0, 160.0)))
    assert state.band is not None and state.band.kept
    assert state.band.values == pytest.approx((140.0, 160.0), abs=0.5)
    QApplication.sendEvent(viewport, QEvent(QEvent.Type.Leave))
    hover(window, 110.0)
    assert state.band.values == pytest.approx((140.0, 160.0), abs=0.5)
    qtbot.waitUntil(lambda: window.generator.canvas.cover is not None)
    QTest.keyClick(window, Qt.Key.Key_P)
    assert state.band is None and window.generator.canvas.cover is None
    # With Ctrl, the edit there is kept.
    state.hover(110.0, effect=True)
    QTest.keyClick(window, Qt.Key.Key_P, Qt.KeyboardModifier.ControlModifier)
    assert state.band.kept and state.band.effect


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
    analyst.gate.release(40)
    qtbot.waitUntil(lambda: window.workspace.sensitivity.fields["exact"].is_of(window.state.inputs))
    qtbot.waitUntil(lambda: drawn.opacity() == 1)
    analyst.gate = None


def test_what_if_shows_the_edit_while_the_key_is_held(qtbot, window):
    what_if = window.sensitivity.what_if
    QTest.keyPress(window, Qt.Key.Key_W)
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    qtbot.waitUntil(lambda: window.generator.canvas.cover is not None)
    assert window.sensitivity.exact.caption.startswith(".1 brighter with +.05 opacity")
    # The fake's second image is .1 brighter than the first.
    assert "brighter by .1, RMS change .1 (exact" in what_if.result
    assert "brighter by .1, RMS change .1 (learned" in what_if.result
    # Without a band, the mode is at the first value of the list.
    value = window.sensitivity.responses.peaks.intervals[0].value
    tried = float(what_if.result.removeprefix("At ").partition(" K:")[0])
    assert tried == pytest.approx(value, abs=0.5)
    QTest.keyRelease(window, Qt.Key.Key_W)
    assert window.reference.canvas.cover is None
    # Once off, nothing is said of what is no longer asked.
    what_if.start()
    window.sensitivity_state.choose(shown=False)
    qtbot.waitUntil(lambda: not what_if._channels.is_pending and not what_if.is_on)
    assert what_if.result == "" and window.reference.canvas.cover is None


def test_a_click_on_what_if_lasts_until_the_next_one(qtbot, window):
    button, exact = window.sensitivity.what_if.button, window.reference.canvas
    button.click()
    qtbot.waitUntil(lambda: exact.cover is not None)
    assert button.isChecked() and exact.cover.pixelColor(0, 0).lightness() > 150
    button.click()
    # On white, strong changes are dark.
    window.overlays.choose_background("white")
    button.click()
    qtbot.waitUntil(lambda: exact.cover is not None)
    assert exact.cover.pixelColor(0, 0).lightness() < 100
    button.click()
    assert exact.cover is None and not button.isChecked()
    # It follows the mouse while it is on.
    what_if, state = window.sensitivity.what_if, window.sensitivity_state
    qtbot.waitUntil(button.isEnabled)
    button.click()
    qtbot.waitUntil(lambda: "(exact" in what_if.result)
    state.hover(170.0)
    # It names the value that the plot does, not the nearest bin, 169.8.
    qtbot.waitUntil(lambda: what_if.result.startswith("At 170"))
    qtbot.waitUntil(lambda: "(exact" in what_if.result)
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
