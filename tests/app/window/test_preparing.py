from dataclasses import replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Qt, QTimer, Signal
from PySide6.QtTest import QTest
from window_fakes import PATIENCE_S

from app.engines.client import EngineState
from app.launch import run_window
from app.state import generator_work, reference_work
from app.state.generator_work import PATH_TITLE
from app.state.library import Library
from app.state.window_start import WindowStart
from app.window.main_window import MainWindow
from model.kernel_cache import KernelGroup
from model.rendering.path_tracing import denoising
from model.scene.scene import Scene


class HeldPreparation(QObject):
    """Prepares what the test says, when it says so."""

    prepared = Signal()
    progressed = Signal(int, int)

    def __init__(self, parent):
        super().__init__(parent)
        self.there = set()
        self.wanted = ()
        self.text = ""

    def want(self, groups):
        self.wanted = groups
        done = len(self.there & set(groups))
        self.text = f"{done} of {len(groups)}" if done < len(groups) else ""
        self.progressed.emit(done, len(groups))

    def is_prepared(self, group):
        return group in self.there

    def finish(self, group):
        self.there.add(group)
        self.want(self.wanted)
        self.prepared.emit()

    def begin(self):
        """Nothing waits."""

    def stop(self):
        """Nothing runs."""


def kernels(_volume, settings):
    light = settings.lighting
    return KernelGroup("uint8", light, "images"), KernelGroup("uint8", light, "questions")


def test_vtk_draws_until_the_kernels_are_compiled(qtbot, builders, monkeypatch):
    monkeypatch.setattr(reference_work, "Preparation", HeldPreparation)
    window = opened(qtbot, builders)
    work, analyst = window.workspace.reference, window.context.analyst
    preparation = work.preparation
    window.workspace.open_model(None)
    window.workspace.opening.open(Path("ramp"))
    window.show()
    client = window.reference.client
    qtbot.waitUntil(lambda: client.is_settled, timeout=1000 * PATIENCE_S)
    images, questions = preparation.wanted
    assert images.lighting == "path"
    assert (work.settings.lighting, work.settings.renderer) == ("direct", "vtk")
    assert analyst.state is EngineState.WAITING
    assert not window.workspace.is_settled
    assert "0 of 2" in window.status.preparation

    preparation.finish(images)
    assert work.settings.lighting == "path"
    assert analyst.state is EngineState.WAITING
    assert "1 of 2" in window.status.preparation
    qtbot.waitUntil(lambda: window.workspace.is_settled, timeout=1000 * PATIENCE_S)

    preparation.finish(questions)
    qtbot.waitUntil(lambda: analyst.is_ready, timeout=1000 * PATIENCE_S)
    assert window.status.preparation == ""

    answers = window.workspace.sensitivity
    qtbot.waitUntil(lambda: bool(answers.regions), timeout=1000 * PATIENCE_S)
    preparation.there.clear()
    work.choose(lighting="soft")
    # They were of another light, or may be of another volume.
    assert not answers.regions


def test_one_image_is_shown_until_the_path_tracer_can_draw(qtbot, builders, monkeypatch):
    monkeypatch.setattr(reference_work, "Preparation", HeldPreparation)
    monkeypatch.setattr(denoising, "installed", lambda: True)
    monkeypatch.setattr(generator_work, "PATH_LIGHT", Path(__file__))
    model_of_ramp = Scene.of(builders.volumes["ramp"], image_size=16)
    monkeypatch.setattr(Library, "scene_of", lambda *_: model_of_ramp)
    window = opened(qtbot, builders)
    work, preparation = window.workspace.reference, window.workspace.reference.preparation
    window.workspace.opening.open(Path("ramp"))
    window.workspace.open_model(Path("model"))
    window.show()
    qtbot.waitUntil(lambda: window.reference.client.is_settled, timeout=1000 * PATIENCE_S)
    assert not window.generator.isVisible()
    assert "path-traced light follows" in window.reference.status
    # One image is named by its light, two by what they are.
    assert window.reference.caption.title.endswith("light")
    assert window.workspace.model.errors == window.status.news == ""
    QTest.keyClick(window, Qt.Key.Key_D)
    assert window.status.news == "Two images follow. 0 of 2"
    assert window.workspace.sensitivity.waiting == "0 of 2"
    assert not builders.generators
    preparation.finish(preparation.wanted[0])
    qtbot.waitUntil(lambda: window.workspace.is_settled, timeout=1000 * PATIENCE_S)
    assert window.generator.isVisible() and window.image_error.is_wanted
    qtbot.waitUntil(lambda: window.generator.caption.title == PATH_TITLE)
    assert "follows" not in window.reference.status
    assert window.reference.caption.title == "Ground truth"
    assert not builders.generators
    # In another light the model has something to show.
    preparation.there.clear()
    work.choose(lighting="none")
    qtbot.waitUntil(lambda: len(builders.generators) == 1, timeout=1000 * PATIENCE_S)
    assert window.generator.isVisible()


def test_where_vtk_cannot_draw_the_window_says_how_long_the_first_kernel_takes(
    qtbot, builders, monkeypatch
):
    monkeypatch.setattr(reference_work, "Preparation", HeldPreparation)
    builders.failing = "direct"
    window = opened(qtbot, builders)
    preparation, client = window.workspace.reference.preparation, window.reference.client
    window.workspace.opening.open(Path("ramp"))
    qtbot.waitUntil(lambda: client.text.endswith("0 of 2"), timeout=1000 * PATIENCE_S)
    assert "no light" in client.text
    assert client.state is EngineState.WAITING
    assert not window.errors
    # It draws in the light that it can first.
    preparation.there.add(KernelGroup("uint8", "soft", "images"))
    preparation.finish(KernelGroup("uint8", "soft", "questions"))
    assert window.workspace.reference.settings.lighting == "soft"
    preparation.finish(preparation.wanted[0])
    # Not before the first picture has rested.
    work = window.workspace.reference
    qtbot.waitUntil(lambda: work.settings.lighting == "path", timeout=1000 * PATIENCE_S)
    qtbot.waitUntil(lambda: window.workspace.is_settled, timeout=1000 * PATIENCE_S)


def test_a_screenshot_says_how_long_the_kernels_take(qapp, builders, monkeypatch, tmp_path, capsys):
    class Quick(HeldPreparation):
        def want(self, groups):
            super().want(groups)
            for group in set(groups) - self.there:
                QTimer.singleShot(0, partial(self.finish, group))

    monkeypatch.setattr(reference_work, "Preparation", Quick)
    start = WindowStart(Path("ramp"), lighting="direct", renderer="raycast")
    made = replace(builders.make(), kernels=kernels)
    assert run_window(start, "auto", tmp_path / "window.png", made) == 0
    assert capsys.readouterr().err == "0 of 2\n"


def opened(qtbot, builders):
    window = MainWindow(replace(builders.make(), kernels=kernels))
    qtbot.addWidget(window)
    window.workspace.reference.choose(lighting="path")
    return window
