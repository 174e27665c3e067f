import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QPushButton
from ramp import make_tf, make_volume
from rested_window import act_until, notice_buttons, open_volume
from window_fakes import FakeEngine

from app.engines.requests import UNWATCHED
from app.state import reference_choices
from model.scene.scene import Scene
from model.scene.transfer_function import GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Caution, FileFacts, Label, Volume


def draw(self, request, watch=UNWATCHED):
    """As opaque as the TF at its most opaque."""
    self.requests.append(request)
    pixels = request.quality.pixels
    level = float(request.inputs.opacity_tf.sample().max())
    return np.full((pixels.height, pixels.width, 4), level, np.float32)


def test_nothing_visible_is_said_with_a_way_out(qtbot, make_window, builders, monkeypatch):
    monkeypatch.setattr(FakeEngine, "image", draw)
    window = make_window(model=None)
    notice = window.notice
    assert notice.text == ""
    empty = TransferFunction(OpacityTF((100.0, 200.0)), make_tf().color)
    window.state.tf_input.move(empty)
    qtbot.waitUntil(lambda: window.reference.canvas.image.pixelColor(1, 1).red() == 0)
    assert notice.text == ""  # not while something is dragged
    window.state.tf_input.finish("drag")
    qtbot.waitUntil(lambda: "transparent" in notice.text)
    notice.findChild(QPushButton).click()
    qtbot.waitUntil(lambda: notice.text == "")
    assert window.state.transfer_function != empty


def draw_slowly(self, request, watch=UNWATCHED):
    """As the ray caster draws, slowly."""
    self.by_raycast = True
    time.sleep(0.1)
    pixels = request.quality.pixels
    return np.full((pixels.height, pixels.width, 4), 0.5, np.float32)


def test_a_light_that_goes_out_is_reported_and_offered(qtbot, make_window, builders, monkeypatch):
    monkeypatch.setattr(FakeEngine, "image", draw_slowly)
    # Of the pixels of a first image, however large the pane.
    monkeypatch.setattr(reference_choices, "SLOW_S", {"direct": 0.01, "soft": 1e-9})
    window = make_window(model=None)
    builders.volumes["other"] = make_volume()
    notice, work = window.notice, window.workspace.reference
    window.workspace.opening.open(Path("other"))
    qtbot.waitUntil(lambda: window.workspace.is_settled and window.workspace.opened is not None)
    qtbot.waitUntil(lambda: window.context.analyst.is_ready)
    for azimuth in (40.0, 50.0):
        act_until(qtbot, window.reference.resultShown, window.state.move_view, View(azimuth))
    window.state.finish_view()
    qtbot.waitUntil(lambda: work.settings.lighting == "direct" and window.workspace.is_settled)
    window.state.set_view(View(azimuth=60.0))
    qtbot.waitUntil(lambda: "has no light" in notice.text)
    assert work.settings.lighting == "none"
    assert window.reference_controls.light.title == "None (too slow)"
    notice_buttons(window)["Light it"].click()
    assert work.settings.lighting == "direct"
    assert notice.text == ""
    qtbot.waitUntil(lambda: window.workspace.is_settled)


VALUES = np.exp(3.5 * np.random.default_rng(8).normal(size=(12, 14, 16))).astype(np.float32)


@pytest.fixture
def halo(builders):
    volume = Volume(VALUES, name="halo")
    builders.volumes["halo"] = volume
    return volume


def offer(window):
    return notice_buttons(window).get("Logarithmic scale")


def shown(window):
    return window.workspace.opened.volume


def click(qtbot, window):
    act_until(qtbot, window.workspace.rangeChanged, offer(window).click)
    qtbot.waitUntil(lambda: window.workspace.is_settled)


def test_one_click_shows_the_logarithm(qtbot, make_window, builders, halo):
    window = make_window("halo", model=None)
    assert "lowest hundredth" in window.notice.text
    before = window.state.transfer_function
    window.sensitivity_state.keep(50.0)
    click(qtbot, window)
    assert not offer(window)
    assert window.sensitivity_state.band is None
    assert window.status.news == "The scale is logarithmic."
    assert window.state.edits.stack.undoText() == "logarithmic scale"
    volume = shown(window)
    np.testing.assert_allclose(volume.voxels, np.log10(VALUES), atol=1e-6)
    assert builders.drawn[-1].scale == "log"
    assert window.state.transfer_function == window.state.default
    assert window.state.scale == "log"
    # The histogram is that of the logarithms.
    expected, _ = np.histogram(np.log10(VALUES), bins=window.editor.area.histogram.edges)
    assert np.abs(expected - window.editor.area.histogram.counts).sum() <= 4
    act_until(qtbot, window.workspace.rangeChanged, window.state.edits.undo)
    assert window.state.transfer_function == before
    assert shown(window).voxels is halo.voxels
    scale = window.editor.menu._scale
    act_until(qtbot, window.workspace.rangeChanged, scale.trigger)
    assert shown(window).scale == "log" and scale.isChecked()
    act_until(qtbot, window.workspace.rangeChanged, scale.trigger)
    assert shown(window).scale == "linear" and not scale.isChecked()
    assert window.state.transfer_function == window.state.default
    values = VALUES.copy()
    values[:3] = 0.0
    builders.volumes["zeros"] = Volume(values, name="zeros")
    for name, is_offered in (("ramp", False), ("zeros", True)):
        open_volume(qtbot, window, name)
        qtbot.waitUntil(lambda: window.workspace.is_settled)
        assert bool(offer(window)) == is_offered
    click(qtbot, window)
    assert "25 % of the voxels are zero or below" in window.status.news


def test_files_numbers_and_what_is_kept_are_on_the_scale(qtbot, make_window, halo, tmp_path):
    window = make_window("halo", model=None, folder=tmp_path / "kept")
    window.state.transfer_function.save(tmp_path / "linear.json")
    click(qtbot, window)
    window.state.transfer_function.save(tmp_path / "log.json")
    log = window.state.transfer_function
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.files.open_transfer_function(tmp_path / "linear.json")
    assert shown(window).scale == "linear"
    assert window.state.transfer_function == TransferFunction.load(tmp_path / "linear.json")
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.files.open_transfer_function(tmp_path / "log.json")
    assert shown(window).scale == "log" and window.state.transfer_function == log
    kept = window.state.transfer_function
    for name in ("ramp", "halo"):
        open_volume(qtbot, window, name)
    assert shown(window).scale == "log"
    assert window.state.transfer_function == kept
    assert not offer(window)


def test_a_model_that_is_read_after_the_volume_brings_its_scale_too(
    qtbot, make_window, builders, halo
):
    scene = builders.scene = Scene.of(halo.on_scale("log").over((-1.0, 2.0)), image_size=16)
    window = make_window("halo", model=None)
    assert shown(window).scale == "linear"
    act_until(qtbot, window.workspace.rangeChanged, window.workspace.open_model, Path("model"))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert (shown(window).scalar_range, shown(window).scale) == (scene.scalar_range, "log")
    assert not window.generator.canvas.message
    act_until(qtbot, window.workspace.rangeChanged, window.state.edits.undo)
    assert shown(window).scale == "linear"
    # One that is read late changes nothing that was made.
    window.workspace.open_model(None)
    opacity = replace(window.state.transfer_function.opacity, modes=(GaussianMode(9.0, 2.0, 0.5),))
    edited = replace(window.state.transfer_function, opacity=opacity)
    window.state.tf_input.set(edited, "edit")
    act_until(qtbot, window.workspace.modelChanged, window.workspace.open_model, Path("model"))
    qtbot.waitUntil(lambda: "on the logarithm" in window.generator.canvas.message)
    assert shown(window).scale == "linear" and window.state.transfer_function == edited


def test_what_is_called_labels_is_shown_as_such_in_one_step(qtbot, make_window, builders):
    values = np.repeat(np.arange(4, dtype=np.uint8), 64).reshape(4, 8, 8)
    facts = FileFacts(labels=(Label(2, "liver"),))
    builders.volumes["organs_seg"] = Volume(values, name="organs seg", file=facts)
    window = make_window("organs_seg", model=None)
    state, before = window.state, window.state.transfer_function
    (button,) = [b for b in window.notice.findChildren(QPushButton) if "as labels" in b.text()]
    act_until(qtbot, window.workspace.rangeChanged, button.click)
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert state.inputs.interpolates is False
    assert builders.references[-1].requests[-1].inputs == state.inputs
    points = ((0.0, 0.0), (1.0, 1.0), (2.0, 1.0), (3.0, 1.0))
    assert state.transfer_function.opacity.points == points
    assert [state.value_text(value) for value in (1.0, 2.0, 3.0)] == ["1", "liver", "3"]
    assert state.range_text((2.0, 2.0)) == "liver"
    with qtbot.waitSignal(window.workspace.rangeChanged):
        state.edits.undo()
        state.edits.undo()
    assert (state.inputs.interpolates, state.transfer_function) == (None, before)
    state.set_interpolates(False)
    memory = window.preferences.volume(window.workspace.opened.fingerprint)
    assert memory.interpolates is False
    state.file = replace(facts, is_labels=True)
    assert [state.range_text((low, 2.4)) for low in (1.6, -0.4)] == ["liver", "0 to 2"]


def test_missing_slices_are_warned_of_until_another_volume(qtbot, make_window, builders):
    note = Caution("Slices may be missing: 1 slice; 2.5 mm is used for all distances.")
    builders.volumes["ct"] = replace(make_volume(), notes=("No unit.", note))
    window = make_window("ct", model=None)
    assert window.notice.text == note
    builders.volumes["other"] = replace(make_volume(), name="other")
    open_volume(qtbot, window, "other")
    assert window.notice.text == ""
