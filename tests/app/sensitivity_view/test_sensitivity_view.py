import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mouse_events import at, drag
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog
from ramp import make_tf, make_volume

from app.window.main_window import MainWindow
from model.errors import RenderError
from model.scene.inputs import SceneInputs
from model.scene.region import Outline
from model.scene.tf_emphasis import STRIKING_COLORS
from model.scene.tf_perturbation import edit_around
from model.scene.volume import Volume
from model.sensitivity.display import shown_responses
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
        np.testing.assert_allclose(responses.curve(name), expected, rtol=1e-5, atol=1e-9)
    assert "cosine 1.00, good" in window.sensitivity.source.said
    (interval,) = responses.peaks.intervals
    assert interval.value == pytest.approx(100 + 100 * 100 / 255)
    assert "1   at 139.2" in window.sensitivity.findings.edit_rows[0].text


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
    # While a region is to be drawn, the image says so.
    before = canvas.grab().toImage()
    state.set_tool("rectangle")
    assert canvas.grab().toImage() != before
    state.set_tool(None)
    assert canvas.grab().toImage() == before


def test_an_error_is_said_and_forgotten(qtbot, window, builders):
    analyst = builders.analysts[-1]
    analyst.error = RenderError("Out of order; wait.")
    window.sensitivity_state.show_layer("curve", True)
    window.sensitivity_state.activate(None)
    qtbot.waitUntil(lambda: "Out of order" in window.sensitivity.source.said)
    assert window.sensitivity.responses.curve("exact").size == 0
    analyst.error = None
    window.sensitivity_state.activate(None)
    qtbot.waitUntil(lambda: "Out of order" not in window.sensitivity.source.said)
    qtbot.waitUntil(lambda: window.sensitivity.responses.curve("exact").size == 256)


def test_another_volume_forgets_the_answers(qtbot, window, builders):
    window.sensitivity_state.keep(150.0)
    window.sensitivity_state.pick((0.5, 0.5))
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    old = builders.analysts[-1]
    builders.volumes["other"] = make_volume("other", 500.0)
    with qtbot.waitSignal(window.workspace.volumeOpened):
        window.workspace.opening.open(Path("other"))
    assert window.sensitivity_state.band is None
    assert window.sensitivity_state.place is None
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
    builders.volumes["flat"] = Volume(make_volume("other").scalars[:, :, :3], name="flat")
    for name, outline in (("ramp 2", region), ("flat", Outline())):
        with qtbot.waitSignal(window.workspace.volumeOpened):
            window.workspace.opening.open(Path(name))
        assert state.outline == outline
    assert window.sensitivity.chips.region.caption == "Whole image ▾"
    qtbot.waitUntil(lambda: window.workspace.is_settled)


def test_a_flag_adds_the_mode_that_was_listed_or_one_in_a_striking_colour(qtbot, window):
    before = window.state.transfer_function
    (interval,) = window.sensitivity.responses.peaks.intervals
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
    assert tuple(striking.color(mode.mean)) in [
        pytest.approx(color, abs=0.02) for color in STRIKING_COLORS
    ]


def test_switched_off_nothing_is_asked_or_shown(qtbot, window, builders):
    window.sensitivity_state.keep(150.0)
    qtbot.waitUntil(lambda: window.reference.canvas.cover is not None)
    QTest.keyClick(window, Qt.Key.Key_E, Qt.KeyboardModifier.ControlModifier)
    assert not window.sensitivity_state.choices.shown
    assert window.reference.canvas.cover is None
    assert not window.sensitivity.findings.isVisible()
    asked = []
    builders.analysts[-1].others, builders.generators[-1].others = asked, asked
    window.state.tf_input.set(make_tf(150.0), "test")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    # Of what was asked before, some may still be answered.
    assert not [request for request in asked if request.inputs == window.state.inputs]
    QTest.mouseClick(window.reference.canvas, Qt.MouseButton.LeftButton, pos=QPoint(60, 60))
    assert window.sensitivity_state.place is None
    # A button that is grey says why.
    button = window.sensitivity.what_if.button
    assert not button.isEnabled()
    assert button.toolTip().startswith("Choose Region > Show sensitivity first")


def test_outside_what_the_model_was_trained_on_is_marked(qtbot, window):
    assert "outside" not in window.sensitivity.source.said
    window.state.set_view(replace(window.state.view, elevation=88.0))
    window.state.set_view(replace(window.state.view, roll=170.0))
    assert "outside what it was trained on" in window.sensitivity.source.said
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
    for _ in range(40):
        builders.analysts[-1].gate.release()
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
