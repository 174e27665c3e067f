import threading
from dataclasses import replace
from functools import partial
from pathlib import Path

from mouse_events import action, drag
from PySide6.QtCore import QCoreApplication, QEvent, QPoint, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QDialog
from ramp import make_tf, make_volume
from rested_window import act_until, open_volume, settle

from model.errors import CheckpointError, RenderError
from model.scene.crop import CropBox
from model.scene.scene import LightDirection, Scene
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.shipped import shipped_volumes, title_of


def shown(pane):
    """Sequence number of the image that a pane shows."""
    return pane.canvas.image.pixelColor(0, 0).red()


def test_both_images_follow_view_and_tf(qtbot, make_window, builders):
    window = make_window()
    assert shown(window.generator) == shown(window.reference)
    assert "CPU" in window.generator.detail
    assert window.windowTitle() == "ramp (4 × 5 × 6) – tfscope"
    assert window.editor.isEnabled()
    # The model was trained without light.
    assert not window.reference_controls.ball.isVisible()
    for pane in (window.generator, window.reference):
        before = window.state.view
        drag(pane.canvas, QPoint(100, 100), QPoint(130, 100))
        settle(qtbot, window)
        assert window.state.view != before
        assert shown(window.generator) == shown(window.reference)
        for engine in (builders.generators[-1], builders.references[-1]):
            assert engine.requests[-1].inputs.view == window.state.view
            assert not engine.requests[-1].quality.live
    assert window.status.view.text().startswith(f"azimuth {window.state.view.azimuth:.0f}° ")
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
    window.state.set_view(View(elevation=89.0))
    assert "elevation 89°" in window.generator.hint and window.reference.hint == ""
    window.state.set_view(View(elevation=-0.2))
    assert "elevation 0°" in window.status.view.text()
    builders.generators[-1].error = RenderError("The generator is out of memory.")
    window.state.set_view(View(azimuth=5.0))
    settle(qtbot, window)
    assert window.errors == ["The generator is out of memory."]
    builders.generators[-1].error = None
    window.state.set_view(View(azimuth=6.0))
    settle(qtbot, window)
    assert window.errors == []
    assert shown(window.generator) == shown(window.reference)
    # A model that cannot be loaded leaves the reference working.
    builders.generator_error = CheckpointError("model: the weights are truncated.")
    window.workspace.open_model(Path("another"))
    qtbot.waitUntil(lambda: window.generator.canvas.message == str(builders.generator_error))
    window.state.set_view(View(azimuth=5.0))
    settle(qtbot, window)
    assert builders.references[-1].requests[-1].inputs.view == View(azimuth=5.0)


def test_without_a_model_the_reference_has_the_window_and_is_lit(qtbot, make_window, builders):
    window = make_window(model=None, size=None)
    assert window.errors == []
    work = window.workspace.reference
    # The first image is a square, until the pane is laid out.
    qtbot.waitUntil(lambda: not work.fits_view and window.reference.canvas.reach[0] > 0.5)
    settle(qtbot, window)
    view, wide = window.state.view, window.reference.canvas.reach
    for browsing in (True, False):
        act_until(qtbot, work.resized, window.latent_state.choose, shown=browsing)
        # The image is as wide as its pane, and shows the same in the square in its middle.
        is_narrow = partial(lambda on: (window.reference.canvas.reach[0] < wide[0]) == on, browsing)
        qtbot.waitUntil(is_narrow)
        settle(qtbot, window)
        assert window.state.view == view
    # The map leaves so little of the window that the home view follows.
    for on_map in (True, False):
        act_until(qtbot, work.resized, window.latent_state.choose, shown=on_map, on_map=True)
        qtbot.waitUntil(
            lambda on=on_map: window.state.is_at_home and (window.state.view != view) == on
        )
    settle(qtbot, window)
    pixels = builders.references[-1].requests[-1].quality.pixels
    assert (pixels.width, pixels.height) == window.reference.canvas.pixels
    work.choose(reference_size=256)
    settle(qtbot, window)
    assert "256 × 256" in window.reference.detail
    assert window.top_bar.compare.isVisible() and not window.top_bar.compare.isChecked()
    assert window.reference.isVisible() and not window.generator.isVisible()
    assert builders.settings[-1].lighting == "soft"
    assert window.reference_controls.ball.isVisible()
    assert builders.references[-1].requests[-1].inputs.light == LightDirection()
    window.workspace.reference.choose(lighting="none")
    settle(qtbot, window)
    assert builders.settings[-1].lighting == "none"
    assert builders.references[-1].requests[-1].inputs.light is None


def test_closing_while_everything_is_at_work_ends_cleanly(qtbot, make_window, builders):
    window = make_window()
    gate = threading.Semaphore(0)
    engine = builders.references[-1]
    engine.gate = gate
    window.state.set_view(View(azimuth=1.0))
    qtbot.waitUntil(lambda: engine.requests[-1].inputs.view == View(azimuth=1.0))
    builders.loading = loading = threading.Event()
    window.workspace.open_model(Path("another"))
    window.workspace.opening.open(Path("ramp"))

    def let_go_when_hidden():
        while window.isVisible():
            threading.Event().wait(0.005)
        gate.release()
        loading.set()

    # The render and the loading end only once the window waits for them.
    helper = threading.Thread(target=let_go_when_hidden)
    helper.start()
    window.close()
    helper.join()
    assert not window.isVisible()
    assert engine.closed
    assert all(g.closed for g in builders.generators)


def test_an_error_of_a_handler_does_not_end_the_process(qtbot, make_window, monkeypatch):
    window, key = make_window(), (QEvent.Type.KeyPress, Qt.Key.Key_Escape)
    monkeypatch.setattr(window, "_escape", lambda: [][0])
    with qtbot.captureExceptions() as errors:
        QCoreApplication.postEvent(window, QKeyEvent(*key, Qt.KeyboardModifier.NoModifier))
        qtbot.waitUntil(lambda: bool(errors))
    assert errors[0][0] is IndexError


def test_the_menus_act(qtbot, make_window, builders, monkeypatch):
    window = make_window()
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
        (box,) = (b for b in window.findChildren(QDialog) if b.windowTitle() == name)
        # What does not fit on a small screen scrolls.
        assert box.isVisible() and box.height() <= window.height()
        box.done(0)
    ramp = builders.volumes["ramp"]
    switch = action(window, "Draw missing voxels")
    assert not switch.isVisible()
    missing = ramp.voxels > ramp.voxels.mean()
    builders.volumes["patchy"] = replace(ramp, name="patchy", missing=missing)
    open_volume(qtbot, window, "patchy")
    settle(qtbot, window)
    assert switch.isVisible()
    assert "Missing voxels (50 %) are not drawn" in window.status.news
    tf = window.state.transfer_function
    act_until(qtbot, window.workspace.rangeChanged, window.workspace.opening.draw_missing, True)
    settle(qtbot, window)
    assert builders.drawn[-1].draws_missing and window.state.transfer_function == tf
    # It comes back with its volume.
    for name in ("ramp", "patchy"):
        open_volume(qtbot, window, name)
        settle(qtbot, window)
        assert builders.drawn[-1].draws_missing == (name == "patchy")
    act_until(qtbot, window.workspace.rangeChanged, switch.trigger)
    settle(qtbot, window)
    assert not builders.drawn[-1].draws_missing
    opened, opening = [], window.workspace.opening
    monkeypatch.setattr(opening, "open", lambda path, *_, **__: opened.append(path))
    for path in shipped_volumes():
        action(window, title_of(path)).trigger()
    assert opened == shipped_volumes()


def test_the_light_is_moved_where_both_images_follow_it(qtbot, make_window, builders):
    volume = builders.volumes["ramp"]
    builders.scene = Scene.of(volume, 16, "direct", movable_light=True)
    window = make_window()
    ball = window.reference_controls.ball
    assert ball.isVisible() and ball.isEnabled()
    assert builders.settings[-1].lighting == "direct"
    window.state.light_input.set(LightDirection(20.0, 10.0))
    settle(qtbot, window)
    for engine in (builders.generators[-1], builders.references[-1]):
        assert engine.requests[-1].inputs.light == LightDirection(20.0, 10.0)
    assert shown(window.generator) == shown(window.reference)
    window.state.light_input.set(LightDirection(85.0, 0.0))
    assert "light azimuth 85°" in window.generator.hint
    builders.scene = Scene.of(volume, 16, "direct")
    act_until(qtbot, window.workspace.modelChanged, window.workspace.open_model, Path("another"))
    settle(qtbot, window)
    assert ball.isVisible() and not ball.isEnabled() and "model" in ball.toolTip()
    assert builders.generators[-1].requests[-1].inputs.light is None


def test_each_volume_is_seen_in_the_light_that_it_was_given(
    qtbot, start_again, builders, monkeypatch
):
    light = LightDirection(50.0, -20.0)
    builders.volumes["other"] = Volume(make_volume("other").voxels[:, :, :3], name="other")
    builders.volumes["ramp 2"] = make_volume("ramp 2", 210.0)
    builders.volumes["ramp 3"] = make_volume("ramp 3", 220.0)

    def opened(window, name):
        act_until(qtbot, window.workspace.settled, window.workspace.opening.open, Path(name))
        return builders.settings[-1].lighting, window.state.light

    fresh, half = ("soft", LightDirection()), CropBox((0.5, 0.0, 0.0))
    first = start_again()
    assert opened(first, "ramp") == fresh
    first.workspace.reference.choose(lighting="soft")
    first.state.light_input.set(light)
    first.brightness.set(2.0)
    first.state.crop_input.set(half)
    assert opened(first, "ramp 2") == ("soft", light)
    assert first.brightness.of("exact") == 2 and first.state.crop == half
    assert opened(first, "other") == fresh
    # What a start has asked for is not kept.
    first.state.start_light(light)
    assert first.brightness.value is None
    first.close()
    second = start_again()
    assert opened(second, "other") == fresh
    assert opened(second, "ramp") == ("soft", light)
    assert second.brightness.of("exact") == 2 and second.state.crop == half
    assert builders.references[-1].requests[-1].inputs.crop == half
    assert not second.state.edits.stack.canUndo()
    second.state.crop_input.set(None)
    second.workspace.reference.choose(keep=False, lighting="none")
    settle(qtbot, second)
    opened(second, "other")
    assert opened(second, "ramp")[0] == "soft" and second.state.crop is None
