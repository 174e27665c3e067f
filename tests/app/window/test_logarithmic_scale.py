"""The logarithmic scale in the window: one click, undo, restart, TF files, numbers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from app.window.main_window import MainWindow
from model.scene.scene import Scene
from model.scene.transfer_function import GaussianMode, TransferFunction
from model.scene.volume import Volume

VALUES = np.exp(3.5 * np.random.default_rng(8).normal(size=(12, 14, 16))).astype(np.float32)


@pytest.fixture
def halo(builders):
    volume = Volume(VALUES, name="halo")
    builders.volumes["halo"] = volume
    return volume


def offer(window: MainWindow) -> list[QPushButton]:
    found = window.notice.findChildren(QPushButton)
    return [b for b in found if b.text() == "Logarithmic scale" and not b.isHidden()]


def shown(window: MainWindow) -> Volume:
    assert window.workspace.opened is not None
    return window.workspace.opened.volume


def click(qtbot: QtBot, window: MainWindow) -> None:
    with qtbot.waitSignal(window.workspace.rangeChanged):
        offer(window)[0].click()
    qtbot.waitUntil(lambda: window.workspace.is_settled)


def test_one_click_shows_the_logarithm(qtbot, make_window, builders, halo):
    window = make_window("halo", model=None)
    assert "lowest hundredth" in window.notice.text
    before = window.state.transfer_function
    window.sensitivity_state.pin(50.0)
    click(qtbot, window)
    assert not offer(window)
    assert window.sensitivity_state.band is None
    assert window.status.news == "The scale is logarithmic."
    assert window.state.edits.stack.undoText() == "logarithmic scale"
    volume = shown(window)
    np.testing.assert_allclose(volume.voxels, np.log10(VALUES), atol=1e-6)
    assert builders.drawn[-1].scale == "log"
    assert window.state.transfer_function == window.state.default_transfer_function
    assert window.state.scale == "log"
    # The histogram is that of the logarithms, and the axis is labelled by values.
    area = window.editor.area
    expected, _ = np.histogram(np.log10(VALUES), bins=area.histogram.edges)
    assert np.abs(expected - area.histogram.counts).sum() <= 4
    lo, hi = area.axis.visible
    for place, text in area.axis.ticks():
        assert lo + place * (hi - lo) == pytest.approx(np.log10(float(text)), abs=1e-6)
    # No request of the reference's has a TF of another scale than its volume.
    for drawn, engine in zip(builders.drawn, builders.references, strict=False):
        assert {r.inputs.opacity_tf.scale for r in engine.requests} <= {drawn.scale}
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.state.edits.undo()
    assert window.state.transfer_function == before
    assert shown(window).voxels is halo.voxels
    scale = window.editor.menu._scale
    with qtbot.waitSignal(window.workspace.rangeChanged):
        scale.setChecked(True)
    assert shown(window).scale == "log" and scale.isChecked()
    with qtbot.waitSignal(window.workspace.rangeChanged):
        scale.setChecked(False)
    assert shown(window).scale == "linear" and not scale.isChecked()
    assert window.state.transfer_function == window.state.default_transfer_function
    values = VALUES.copy()
    values[:3] = 0.0
    builders.volumes["zeros"] = Volume(values, name="zeros")
    for name, is_offered in (("ramp", False), ("zeros", True)):
        with qtbot.waitSignal(window.workspace.volumeStarted):
            window.workspace.opening.open(Path(name))
        qtbot.waitUntil(lambda: window.workspace.is_settled)
        assert bool(offer(window)) == is_offered
    click(qtbot, window)
    assert "25 % of the voxels are zero or below" in window.status.news


def test_files_numbers_and_what_is_kept_are_on_the_scale(qtbot, make_window, halo, tmp_path):
    window = make_window("halo", model=None, folder=tmp_path / "kept")
    window.state.save_transfer_function(tmp_path / "linear.json")
    click(qtbot, window)
    window.state.save_transfer_function(tmp_path / "log.json")
    log = window.state.transfer_function
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.files.open_transfer_function(tmp_path / "linear.json")
    assert shown(window).scale == "linear"
    assert window.state.transfer_function == TransferFunction.load(tmp_path / "linear.json")
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.files.open_transfer_function(tmp_path / "log.json")
    assert shown(window).scale == "log" and window.state.transfer_function == log
    opacity = replace(window.state.transfer_function.opacity, modes=(GaussianMode(1.0, 0.5, 0.5),))
    window.state.tf_input.set(replace(window.state.transfer_function, opacity=opacity), "edit")
    window.editor.selection.select("opacity", 0)
    box = window.editor.card.value
    assert box.text() == "10"
    box.lineEdit().setText("250")
    box.interpretText()
    mode = window.state.transfer_function.opacity.modes[0]
    assert mode.mean == pytest.approx(np.log10(250), abs=1e-6)
    box.lineEdit().setText("-3")
    assert not box.hasAcceptableInput()
    kept = window.state.transfer_function
    for name in ("ramp", "halo"):
        with qtbot.waitSignal(window.workspace.volumeStarted):
            window.workspace.opening.open(Path(name))
    assert shown(window).scale == "log"
    assert window.state.transfer_function == kept
    assert not offer(window)


def shows_as_the_model(window: MainWindow, scene: Scene) -> bool:
    volume, canvas = shown(window), window.generator.canvas
    return (volume.scalar_range, volume.scale) == (scene.scalar_range, "log") and not canvas.message


def test_a_model_that_is_read_after_the_volume_brings_its_scale_too(
    qtbot, make_window, builders, halo
):
    scene = builders.scene = Scene.of(halo.on_scale("log").over((-1.0, 2.0)), image_size=16)
    window = make_window("halo", model=None)
    assert shown(window).scale == "linear"
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.workspace.open_model(Path("model"))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert shows_as_the_model(window, scene)
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.state.edits.undo()
    assert shown(window).scale == "linear"
    # One that is read late changes nothing that was made.
    window.workspace.open_model(None)
    opacity = replace(window.state.transfer_function.opacity, modes=(GaussianMode(9.0, 2.0, 0.5),))
    edited = replace(window.state.transfer_function, opacity=opacity)
    window.state.tf_input.set(edited, "edit")
    with qtbot.waitSignal(window.workspace.modelChanged):
        window.workspace.open_model(Path("model"))
    qtbot.waitUntil(lambda: "over the logarithm" in window.generator.canvas.message)
    assert shown(window).scale == "linear" and window.state.transfer_function == edited
