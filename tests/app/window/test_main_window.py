"""The window as a whole, on fake engines."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QDialog
from pytestqt.qtbot import QtBot
from ramp import make_tf, make_volume
from window_fakes import FakeBuilders, FakeEngine

from app.image_view.engine_pane import EnginePane
from app.state.preferences import Preferences, PreferencesStore
from app.state.transfer_function_keeper import TransferFunctionStore
from app.state.viewer_state import HOME_VIEW
from app.window.main_window import MainWindow
from model.errors import CheckpointError, RenderError
from model.scene.crop import CropBox
from model.scene.light import LightDirection
from model.scene.region import Outline
from model.scene.scene import Scene
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.shipped import shipped_volumes

WindowMaker = Callable[..., MainWindow]


def shown(pane: EnginePane) -> int:
    """Sequence number of the image that a pane shows."""
    assert pane.canvas.image is not None
    return pane.canvas.image.pixelColor(0, 0).red()


def action(window: MainWindow, text: str) -> QAction:
    (found,) = (a for a in window.findChildren(QAction) if a.text().replace("&", "") == text)
    return found


def settle(qtbot: QtBot, window: MainWindow) -> None:
    qtbot.waitUntil(lambda: window.workspace.is_settled)


def test_both_images_follow_view_and_tf(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window()
    assert shown(window.generator) == shown(window.reference)
    assert "CPU" in window.generator.detail
    assert "16 × 16" in window.generator.detail
    assert window.windowTitle() == "ramp (4 × 5 × 6) – tfscope"
    assert window.editor.isEnabled()
    assert window.editor.card.heading.endswith("of 3")
    # The model was trained without light.
    assert not window.reference_controls.ball.isVisible()
    for pane in (window.generator, window.reference):
        before = window.state.view
        QTest.mousePress(pane.canvas, Qt.MouseButton.LeftButton, pos=QPoint(100, 100))
        QTest.mouseMove(pane.canvas, QPoint(130, 100))
        QTest.mouseRelease(pane.canvas, Qt.MouseButton.LeftButton, pos=QPoint(130, 100))
        settle(qtbot, window)
        assert window.state.view != before
        assert shown(window.generator) == shown(window.reference)
        for engine in (builders.generators[-1], builders.references[-1]):
            assert engine.requests[-1].inputs.view == window.state.view
            assert not engine.requests[-1].quality.live
    assert window.status.view_text.startswith(f"azimuth {window.state.view.azimuth:.0f}° ")
    engine = builders.generators[-1]
    first = len(engine.requests)
    window.state.move_view(View(azimuth=10.0))
    qtbot.waitUntil(lambda: len(engine.requests) > first)
    window.state.finish_view()
    settle(qtbot, window)
    assert engine.requests[first].quality.live
    assert not engine.requests[-1].quality.live
    window.state.tf_input.set(make_tf(140.0), "edit")
    settle(qtbot, window)
    for engine in (builders.generators[-1], builders.references[-1]):
        assert engine.requests[-1].inputs.transfer_function == make_tf(140.0)
    assert window.generator.hint == ""
    window.state.set_view(View(elevation=89.0))
    assert "elevation 89°" in window.generator.hint
    assert window.reference.hint == ""
    window.state.set_view(HOME_VIEW)
    assert window.generator.hint == ""
    builders.generators[-1].error = RenderError("The generator is out of memory.")
    window.state.set_view(View(azimuth=5.0))
    settle(qtbot, window)
    assert window.errors == ["The generator is out of memory."]
    builders.generators[-1].error = None
    window.state.set_view(View(azimuth=6.0))
    settle(qtbot, window)
    assert window.errors == []
    assert shown(window.generator) == shown(window.reference)


def test_a_model_that_cannot_be_loaded_leaves_the_reference_working(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    builders.generator_error = CheckpointError("model: the weights are truncated.")
    window = make_window()
    assert window.generator.canvas.message == "model: the weights are truncated."
    window.state.set_view(View(azimuth=5.0))
    settle(qtbot, window)
    assert builders.references[-1].requests[-1].inputs.view == View(azimuth=5.0)


def test_without_a_model_the_reference_has_the_window_and_is_lit(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window(model=None)
    assert window.errors == []
    assert "512 × 512" in window.reference.detail
    assert not window.top_bar.compare.isEnabled() and not window.top_bar.compare.isChecked()
    assert window.reference.isVisible() and not window.generator.isVisible()
    assert builders.settings[-1].lighting == "soft"
    assert window.reference_controls.ball.isVisible()
    assert builders.references[-1].requests[-1].inputs.light == LightDirection()
    window.workspace.reference.choose(lighting="none")
    settle(qtbot, window)
    assert builders.settings[-1].lighting == "none"
    assert builders.references[-1].requests[-1].inputs.light is None
    work, bar = window.workspace.reference, window.reference_controls
    assert bar.light.accessibleName() == "Light: None"
    assert "automatically" not in bar.light.toolTip()
    work.choose(lighting="auto")
    assert "automatically" in bar.light.toolTip()
    (switch,) = (
        found
        for found in window.findChildren(QAction)
        if found.text() == "Denoise path-traced light"
    )
    switch.setEnabled(True)
    for denoises in (False, True):
        switch.trigger()
        assert work.choices.denoises is denoises
    work.choose(denoises=False)
    assert not switch.isChecked()


def test_nothing_moves_but_what_the_user_moves(make_window: WindowMaker) -> None:
    window = make_window()
    height = window.reference.height()
    editing = action(window, "TF editor")
    editing.trigger()
    QTest.qWait(50)
    assert window.editor.isHidden()
    assert window.reference.height() > height + 150
    editing.trigger()
    QTest.qWait(50)
    assert window.editor.isVisible()
    assert window.reference.height() == height

    def places() -> list[QRect]:
        QTest.qWait(20)
        parts = (window.generator.canvas, window.reference.canvas, window.editor, window)
        return [QRect(part.mapToGlobal(QPoint()), part.size()) for part in parts]

    before = places()
    for text in ("It failed.", "It failed, too. " * 20):
        window.notice.tell(text, tone="error")
        assert places() == before
    window.up_axis_card.ask("+z")
    window.crop_card.set_shown(True)
    action(window, "Rectangle").trigger()
    assert places() == before
    images = QRect(window.panes.mapTo(window, QPoint()), window.panes.size())
    floating = (window.notice, window.up_axis_card, window.crop_card)
    seen = [QRect(each.mapTo(window, QPoint()), each.size()) for each in floating]
    assert all(each.isVisible() for each in floating)
    assert all(images.contains(each) for each in seen)
    assert not [1 for one in seen for other in seen if one is not other and one.intersects(other)]


def test_a_model_of_another_volume_is_refused_until_its_volume_comes(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    other = make_volume("other", top=300.0)
    builders.volumes["other"] = other
    builders.scene = Scene.of(other, image_size=16)
    window = make_window()
    message = window.generator.canvas.message
    assert "'other'" in message
    assert message.count(".") == 1
    assert builders.generators[-1].requests == []
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.reading.open(Path("other"))
    settle(qtbot, window)
    assert shown(window.generator) == shown(window.reference)
    assert len(builders.generators) == 1


def test_a_missing_volume_is_an_error_at_first_and_a_notice_later(
    qtbot: QtBot, make_window: WindowMaker
) -> None:
    window = make_window(volume="gone")
    assert window.errors == ["gone: the file is missing; choose another."]
    assert not window.editor.isEnabled()
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.reading.open(Path("ramp"))
    settle(qtbot, window)
    assert window.errors == []
    with qtbot.waitSignal(window.workspace.problem):
        window.workspace.reading.open(Path("gone"))
    assert window.notice.text == "gone: the file is missing; choose another."
    assert window.notice.isVisible()
    assert window.workspace.opened is not None
    assert window.workspace.opened.volume.name == "ramp"
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.reading.open(Path("ramp"))
    assert window.notice.text == ""


def test_each_volume_keeps_its_tf_for_the_next_run(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders, tmp_path: Path
) -> None:
    builders.volumes["other"] = other = make_volume("other", top=300.0)
    store = TransferFunctionStore(tmp_path)
    store.path(builders.volumes["ramp"].fingerprint).write_text("{}")
    first = make_window(store=store)
    assert "tfscope_tf" in first.notice.text
    default = first.state.transfer_function
    assert len(default.opacity.modes) == 3
    first.state.tf_input.set(make_tf(142.0), "edit")
    with qtbot.waitSignal(first.workspace.volumeStarted):
        first.workspace.reading.open(Path("other"))
    assert store.load(other.fingerprint) is None
    assert first.state.scalar_range == (100.0, 300.0)
    with qtbot.waitSignal(first.workspace.volumeStarted):
        first.workspace.reading.open(Path("ramp"))
    assert first.state.transfer_function == make_tf(142.0)
    settle(qtbot, first)
    first.close()
    second = make_window(store=store)
    assert second.state.transfer_function == make_tf(142.0)
    second.state.reset_transfer_function()
    assert second.state.transfer_function == default


def let_go_when_hidden(
    window: MainWindow, gate: threading.Semaphore, loading: threading.Event
) -> None:
    while window.isVisible():
        threading.Event().wait(0.005)
    gate.release()
    loading.set()


def test_closing_while_everything_is_at_work_ends_cleanly(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window()
    gate = threading.Semaphore(0)
    engine = builders.references[-1]
    engine.gate = gate
    window.state.set_view(View(azimuth=1.0))
    qtbot.waitUntil(lambda: engine.requests[-1].inputs.view == View(azimuth=1.0))
    builders.loading = loading = threading.Event()
    window.workspace.open_model(Path("another"))
    window.workspace.reading.open(Path("ramp"))
    # The render and the loading end only once the window waits for them.
    helper = threading.Thread(target=let_go_when_hidden, args=(window, gate, loading))
    helper.start()
    window.close()
    helper.join()
    assert not window.isVisible()
    assert engine.closed
    assert all(g.closed for g in builders.generators)


def test_the_reference_fills_its_pane_and_regions_stay_on_their_voxels(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window(model=None, size="pane")
    work = window.workspace.reference
    # The first image is a square, until the pane is laid out.
    qtbot.waitUntil(lambda: not work.fits_view and window.reference.canvas.reach[0] > 0.5)
    settle(qtbot, window)
    view, wide = window.state.view, window.reference.canvas.reach
    window.sensitivity_state.add_region(Outline.rectangle(0.4, 0.4, 0.6, 0.6))
    for browsing in (True, False):
        with qtbot.waitSignal(work.resized):
            window.latent_state.choose(shown=browsing)
        # The image is as wide as its pane, and shows the same in the square in its middle.
        is_narrow = partial(lambda on: (window.reference.canvas.reach[0] < wide[0]) == on, browsing)
        qtbot.waitUntil(is_narrow)
        settle(qtbot, window)
        assert window.state.view == view
    window.state.reset_view()
    assert window.state.view == window.state.home
    pixels = builders.references[-1].requests[-1].quality.pixels
    assert (pixels.width, pixels.height) == window.reference.canvas.pixels
    work.choose(size=256)
    settle(qtbot, window)
    assert "256 × 256" in window.reference.detail


def test_the_menus_act(
    qtbot: QtBot,
    make_window: WindowMaker,
    builders: FakeBuilders,
    monkeypatch: pytest.MonkeyPatch,
    qapp: QApplication,
) -> None:
    window = make_window()
    for name, toward_camera in {
        "Front": (0, -1, 0),
        "Back": (0, 1, 0),
        "Right": (1, 0, 0),
        "Left": (-1, 0, 0),
        "Top": (0, 0, 1),
        "Bottom": (0, 0, -1),
    }.items():
        window.state.set_view(replace(HOME_VIEW, distance=0.6, roll=5.0))
        action(window, name).trigger()
        view = window.state.view
        assert view.basis()[2] == pytest.approx(toward_camera, abs=1e-12)
        assert (view.roll, view.distance) == (0.0, 0.6)
    assert not action(window, "Free rotation").isChecked()
    window.state.set_trackball(True)
    assert action(window, "Free rotation").isChecked()
    before = window.state.transfer_function
    undo, redo = action(window, "Undo"), action(window, "Redo")
    assert not undo.isEnabled()
    window.state.tf_input.set(make_tf(), "edit")
    undo.trigger()
    assert window.state.transfer_function == before
    assert not undo.isEnabled()
    redo.trigger()
    assert window.state.transfer_function == make_tf()
    for name in ("Keys and gestures", "About tfscope"):
        action(window, name).trigger()
    titles = {"Keys and gestures", "About tfscope"}
    boxes = [b for b in window.findChildren(QDialog) if b.windowTitle() in titles]
    assert len(boxes) == 2
    for box in boxes:
        assert box.isVisible()
        # What does not fit on a small screen scrolls.
        assert box.height() <= window.height()
        box.done(0)
    ramp = builders.volumes["ramp"]
    switch = action(window, "Draw missing voxels")
    assert not switch.isEnabled()
    missing = ramp.voxels > ramp.voxels.mean()
    builders.volumes["patchy"] = replace(ramp, name="patchy", missing=missing)
    with qtbot.waitSignal(window.workspace.volumeStarted):
        window.workspace.reading.open(Path("patchy"))
    settle(qtbot, window)
    assert "voxels are missing, and not drawn" in window.status.news
    tf = window.state.transfer_function
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.workspace.ranging.draw_missing(True)
    settle(qtbot, window)
    assert builders.drawn[-1].draws_missing and window.state.transfer_function == tf
    with qtbot.waitSignal(window.workspace.rangeChanged):
        switch.trigger()
    settle(qtbot, window)
    assert not builders.drawn[-1].draws_missing
    opened: list[Path] = []
    monkeypatch.setattr(
        window.workspace.reading, "open", lambda path, *_, **__: opened.append(path)
    )
    for name in ("Chest CT (LIDC)", "Reacting jet, temperature"):
        action(window, name).trigger()
    assert opened == shipped_volumes()


def test_an_engine_slower_than_the_mouse_is_never_queued(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window()
    # Built once more if the model, whose light is another, comes after the volume.
    assert {s.renderer for s in builders.settings} == {"auto"}
    window.workspace.reference.choose(drawing="raycast")
    settle(qtbot, window)
    assert builders.settings[-1].renderer == "raycast"
    assert builders.references[0].closed
    window.workspace.reference.choose(drawing="vtk")
    settle(qtbot, window)
    assert builders.settings[-1].renderer == "vtk"
    engine: FakeEngine = builders.references[-1]
    engine.gate = threading.Semaphore(0)
    before = len(engine.requests)
    window.state.move_view(View(azimuth=0.0))
    qtbot.waitUntil(lambda: len(engine.requests) == before + 1)
    for azimuth in range(1, 50):
        window.state.move_view(View(azimuth=float(azimuth)))
    window.state.finish_view()
    for _ in range(2):
        engine.gate.release()
    settle(qtbot, window)
    assert len(engine.requests) == before + 2
    assert engine.requests[-1].inputs.view == View(azimuth=49.0)
    engine.gate = None


def test_the_light_is_moved_where_both_images_follow_it(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    volume = builders.volumes["ramp"]
    builders.scene = Scene.of(volume, 16, "direct", movable_light=True)
    window = make_window()
    assert window.reference_controls.ball.isVisible()
    assert builders.settings[-1].lighting == "direct"
    window.state.light_input.set(LightDirection(20.0, 10.0))
    settle(qtbot, window)
    for engine in (builders.generators[-1], builders.references[-1]):
        assert engine.requests[-1].inputs.light == LightDirection(20.0, 10.0)
    assert shown(window.generator) == shown(window.reference)
    window.state.light_input.set(LightDirection(85.0, 0.0))
    assert "light azimuth 85°" in window.generator.hint


def test_a_fixed_light_is_not_offered_to_be_moved(
    make_window: WindowMaker, builders: FakeBuilders
) -> None:
    builders.scene = Scene.of(builders.volumes["ramp"], 16, "direct")
    window = make_window()
    ball = window.reference_controls.ball
    assert ball.isVisible()
    assert not ball.isEnabled() and "model" in ball.toolTip()
    assert builders.generators[-1].requests[-1].inputs.light is None


def test_a_light_is_proposed_only_for_a_volume_that_was_seen_in_none(
    qtbot: QtBot, builders: FakeBuilders, tmp_path: Path
) -> None:
    place = PreferencesStore(tmp_path / "preferences.json")
    for chosen, seen in (("direct", "path"), (None, "direct")):
        window = MainWindow(builders.make(), preferences=Preferences(place))
        qtbot.addWidget(window)
        window.workspace.reference.propose("path")
        with qtbot.waitSignal(window.workspace.settled):
            window.workspace.reading.open(Path("ramp"))
        assert builders.settings[-1].lighting == seen
        if chosen is not None:
            window.workspace.reference.choose(lighting=chosen)
            settle(qtbot, window)
        window.close()


def test_each_volume_is_seen_in_the_light_that_it_was_given(
    qtbot: QtBot, builders: FakeBuilders, tmp_path: Path
) -> None:
    place, light = PreferencesStore(tmp_path / "preferences.json"), LightDirection(50.0, -20.0)
    builders.volumes["other"] = Volume(make_volume("other").scalars[:, :, :3], name="other")
    builders.volumes["ramp 2"] = make_volume("ramp 2", 210.0)

    def opened(name: str, window: MainWindow | None = None, **chosen: Any) -> MainWindow:
        if window is None:
            window = MainWindow(builders.make(), preferences=Preferences(place))
            qtbot.addWidget(window)
        if chosen:
            window.workspace.reference.choose(keep=False, **chosen)
        with qtbot.waitSignal(window.workspace.settled):
            window.workspace.reading.open(Path(name))
        return window

    def shown(window: MainWindow) -> tuple[str, LightDirection | None]:
        return builders.settings[-1].lighting, window.state.light

    fresh, half = ("soft", LightDirection()), CropBox((0.5, 0.0, 0.0))
    first = opened("ramp")
    assert shown(first) == fresh
    first.workspace.reference.choose(lighting="soft")
    first.state.light_input.set(light)
    first.brightness.set(2.0)
    first.state.crop_input.set(half)
    assert shown(opened("ramp 2", first)) == ("soft", light)
    assert first.brightness.value == 2 and first.state.crop is None
    assert shown(opened("other", first)) == fresh
    # What a start has asked for is not kept.
    first.workspace.reference.light.place(light)
    assert not first.brightness.is_chosen
    first.close()
    second = opened("other")
    assert shown(second) == fresh
    assert shown(opened("ramp", second)) == ("soft", light)
    assert second.brightness.value == 2 and second.state.crop == half
    assert builders.references[-1].requests[-1].inputs.crop == half
    assert not second.state.edits.stack.canUndo()
    second.state.crop_input.set(None)
    second.state.light_input.set(LightDirection())
    second.close()
    third = opened("ramp", lighting="none")
    assert shown(third) == ("none", None) and third.state.crop is None
    third.close()
    assert shown(opened("ramp")) == ("soft", LightDirection())


def test_the_ray_caster_draws_while_something_moves_and_vtk_at_rest(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window()
    reference, analyst = builders.references[-1], builders.analysts[-1]
    qtbot.waitUntil(lambda: window.workspace._analyst.is_ready)
    drawn = len(reference.requests)
    window.state.move_view(View(azimuth=10.0))
    qtbot.waitUntil(lambda: bool(analyst.requests) and analyst.requests[-1].quality.live)
    assert len(reference.requests) == drawn
    window.state.finish_view()
    settle(qtbot, window)
    assert not reference.requests[-1].quality.live
    window.workspace.reference.choose(drawing="vtk")
    settle(qtbot, window)
    reference = builders.references[-1]
    before = len(analyst.requests)
    window.state.move_view(View(azimuth=20.0))
    qtbot.waitUntil(lambda: reference.requests[-1].quality.live)
    window.state.finish_view()
    settle(qtbot, window)
    assert len(analyst.requests) == before
