import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtTest import QTest
from ramp import make_tf, make_volume
from rested_window import open_volume, settle

from app.engines.client import EngineState
from app.engines.engines import REAL_BUILDERS
from app.engines.requests import SupersededError
from app.picture import BLACK
from app.state import open_model, reference_choices, reference_image
from app.state.library import Library
from app.state.open_model import PATH_DRAWER
from app.window.figure import FigureChoice
from app.window.main_window import MainWindow
from model.errors import CannotDrawError
from model.kernel_cache import KernelGroup
from model.rendering import opengl, vtk_renderer
from model.rendering.path_tracing import denoising
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.view import View


class HeldPreparation(QObject):
    """Prepares what the test says, when it says so."""

    prepared = Signal()
    progressed = Signal(int, int, str)

    def __init__(self, parent):
        super().__init__(parent)
        self.there = set()
        self.wanted = ()
        self.text = ""

    def want(self, groups):
        self.wanted = groups
        done = len(self.there & set(groups))
        self.text = f"{done} of {len(groups)}" if done < len(groups) else ""
        self.progressed.emit(done, len(groups), self.text)

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


@pytest.fixture
def network(monkeypatch):
    """The network of path-traced light and its denoiser are there."""
    monkeypatch.setattr(denoising, "installed", lambda: True)
    monkeypatch.setattr(open_model, "PATH_LIGHT", Path(__file__))


def kernels(_volume, settings):
    light = settings.lighting
    return KernelGroup("uint8", light, "images"), KernelGroup("uint8", light, "questions")


@pytest.fixture
def held(qtbot, builders, monkeypatch):
    """A window in path-traced light, whose kernels wait for the test."""
    monkeypatch.setattr(reference_image, "Preparation", HeldPreparation)
    window = MainWindow(replace(builders.make(), kernels=kernels))
    qtbot.addWidget(window)
    window.workspace.reference.choose(lighting="path")
    window.show()
    return window


def test_vtk_draws_until_the_kernels_are_compiled(qtbot, held):
    window, work, analyst = held, held.workspace.reference, held.context.analyst
    preparation, client = work.preparation, window.reference.client
    window.workspace.opening.open(Path("ramp"))
    qtbot.waitUntil(lambda: client.is_settled)
    images, questions = preparation.wanted
    assert images.lighting == "path"
    assert (work.settings.lighting, work.settings.renderer) == ("direct", "vtk")
    assert analyst.state is EngineState.WAITING
    assert not window.workspace.is_settled
    assert "0 of 2" in window.status.prepared.text()

    preparation.finish(images)
    assert work.settings.lighting == "path"
    assert analyst.state is EngineState.WAITING
    assert "1 of 2" in window.status.prepared.text()
    qtbot.waitUntil(lambda: window.workspace.is_settled)

    preparation.finish(questions)
    qtbot.waitUntil(lambda: analyst.is_ready)
    assert window.status.prepared.isHidden()

    answers = window.workspace.sensitivity
    qtbot.waitUntil(lambda: bool(answers.regions))
    preparation.there.clear()
    work.choose(lighting="soft")
    # They were of another light, or may be of another volume.
    assert not answers.regions


def test_figures_wait_for_the_engine_and_sessions_keep_the_light_that_follows(
    qtbot, builders, held, tmp_path
):
    window, work, place = held, held.workspace.reference, tmp_path / "figure.png"
    client = window.reference.client
    window.workspace.opening.open(Path("ramp"))
    qtbot.waitUntil(lambda: client.is_settled)

    def give_up(request, watch):
        while watch.is_wanted():
            time.sleep(0.01)
        raise SupersededError

    window.state.tf_input.compare(True)
    work.choose_look(lighting="direct")
    qtbot.waitUntil(lambda: window.pane_b.canvas.image is not None)
    for engine in builders.references:
        engine.picture = give_up
    window.saving.draw(FigureChoice(90, 40, which="a_b"), place)
    assert work.settings.lighting == "direct"
    assert window.sessions.session().content.memory.lighting == "path"
    work.preparation.finish(work.preparation.wanted[0])
    # Its image is still there.
    assert client.state is EngineState.LOADING and window.saving.sizes()
    titles = window.saving._job.subject.titles
    assert (titles["reference"], titles["b"]) == ("A, path-traced light", "B, direct light")
    qtbot.waitUntil(place.exists)
    assert not window.notice.text


def test_one_image_is_shown_until_the_path_tracer_can_draw(
    qtbot, builders, network, monkeypatch, held
):
    model_of_ramp = Scene.of(builders.volumes["ramp"], image_size=16)
    monkeypatch.setattr(Library, "scene_of", lambda *_: model_of_ramp)
    window, work, preparation = held, held.workspace.reference, held.workspace.reference.preparation
    window.workspace.opening.open(Path("ramp"))
    window.workspace.open_model(Path("model"))
    qtbot.waitUntil(lambda: window.reference.client.is_settled)
    assert not window.generator.isVisible()
    assert "path-traced light follows" in window.reference.caption.detail
    # One image is named by its light, two by what they are.
    assert window.reference.caption.title.endswith("light")
    assert window.workspace.model.errors == window.status.news == ""
    QTest.keyClick(window, Qt.Key.Key_D)
    assert window.status.news.startswith("Two images follow")
    assert window.workspace.sensitivity.waiting == "0 of 2"
    assert not builders.generators
    preparation.finish(preparation.wanted[0])
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert window.generator.isVisible() and window.image_error.is_wanted
    qtbot.waitUntil(lambda: window.generator.caption.detail == PATH_DRAWER)
    assert "follows" not in window.reference.caption.detail
    assert window.reference.caption.title == "Ground truth"
    assert not builders.generators
    # In another light the model has something to show.
    preparation.there.clear()
    work.choose(lighting="none")
    qtbot.waitUntil(lambda: len(builders.generators) == 1)
    assert window.generator.isVisible()
    # As it was left, so it opens: with the model's image, or without where it was not asked for.
    key = window.workspace.opened.fingerprint
    assert window.preferences.volume(key).shows_model
    monkeypatch.setattr(window.workspace, "keep", lambda **_: None)  # what is noted here stays
    for shows in (True, False):
        window.preferences.note_volume(key, shows_model=shows)
        open_volume(qtbot, window, "ramp")
        assert window.generator.isVisible() == shows


def test_where_vtk_cannot_draw_the_window_says_how_long_the_first_kernel_takes(
    qtbot, builders, held
):
    builders.failing = "direct"
    window, work = held, held.workspace.reference
    preparation, client = work.preparation, window.reference.client
    window.workspace.opening.open(Path("ramp"))
    qtbot.waitUntil(lambda: client.text.endswith("0 of 2"))
    assert "no light" in client.text
    assert client.state is EngineState.WAITING
    assert not window.errors
    # It draws in the light that it can first.
    preparation.there.add(KernelGroup("uint8", "soft", "images"))
    preparation.finish(KernelGroup("uint8", "soft", "questions"))
    assert work.settings.lighting == "soft"
    preparation.finish(preparation.wanted[0])
    # Not before the first picture has rested.
    qtbot.waitUntil(lambda: work.settings.lighting == "path")
    qtbot.waitUntil(lambda: window.workspace.is_settled)


def test_the_network_draws_while_the_light_is_path_traced(
    qtbot, make_window, builders, network, monkeypatch
):
    window = make_window()
    reference, open_model_of = window.workspace.reference, window.files.open_model
    model = builders.generators[-1]

    def settled(act, *arguments, **changes):
        act(*arguments, **changes)
        settle(qtbot, window)

    assert window.generator.caption.title == "Generator"
    settled(reference.choose, lighting="path")
    # A light changes no more than the light.
    assert window.panes.images == [window.generator, window.reference]
    QTest.keyClick(window, Qt.Key.Key_C)
    for light in ("none", "path"):
        settled(reference.choose, lighting=light)
        assert window.panes.images == [window.reference]
    QTest.keyClick(window, Qt.Key.Key_C)
    assert len(window.panes.images) == 2
    settle(qtbot, window)
    assert window.generator.caption.detail.startswith(PATH_DRAWER)
    assert window.generator.caption.title == "Denoised sample"
    assert "serves all volumes" in window.workspace.model.errors
    # One engine for each pane, of one sample and of many, each time.
    samples = sorted(each.samples for each in builders.settings if each.lighting == "path")
    assert samples == [1, 1, 64, 64]
    assert window.workspace.model.lighting == "path"
    assert window.workspace.sensitivity.exact_source == "other light"
    assert "Trained with" not in window.generator.hint
    # The model answers nothing meanwhile.
    assert window.workspace.latent.session.model is None
    asked = len(model.requests)
    window.state.move_view(window.state.view)
    window.state.finish_view()
    settle(qtbot, window)
    assert len(model.requests) == asked
    settled(reference.choose, lighting="none")
    assert window.generator.caption.title == "Generator"
    # It is not loaded again.
    assert builders.generators[-1] is not model and builders.kept[-1] is builders.kept[-2]
    assert window.workspace.sensitivity.exact_source == "exact"
    assert window.workspace.latent.session.model is not None
    # Without the network or the denoiser the model stays.
    monkeypatch.setattr(open_model, "PATH_LIGHT", Path("missing"))
    settled(reference.choose, lighting="path")
    assert window.generator.caption.title == "Generator"
    assert "Trained with no light" in window.generator.hint
    monkeypatch.setattr(open_model, "PATH_LIGHT", Path(__file__))
    settled(reference.choose, denoises=False)
    assert window.generator.caption.title == "Generator"
    # Opened by its name, a model is to be seen: in its light.
    settled(reference.choose, denoises=True)
    monkeypatch.setattr(Library, "check_model", lambda *_: model.scene)
    settled(open_model_of, Path("model"))
    assert reference.settings.lighting == "none" and window.generator.isVisible()
    trained = model.scene
    # And without a model there is one pane still.
    window.workspace.open_model(None)
    settled(reference.choose, lighting="path")
    assert not window.generator.isVisible()
    # So is the first one.
    monkeypatch.setattr(Library, "check_model", lambda *_: trained)
    settled(open_model_of, Path("model"))
    assert reference.settings.lighting == "none" and window.generator.isVisible()
    # One of another volume leaves the light.
    settled(reference.choose, lighting="path")
    other = replace(trained, volume_fingerprint="other")
    monkeypatch.setattr(Library, "check_model", lambda *_: other)
    settled(open_model_of, Path("other"))
    assert reference.settings.lighting == "path"


def test_a_volume_that_was_seen_in_path_traced_light_opens_in_a_quicker_one(
    qtbot, make_window, builders, network
):
    builders.volumes["other"] = make_volume("other", 300.0)
    window = make_window(model=None)
    reference = window.workspace.reference
    reference._first_rest.setInterval(1)
    # Who looks at it has it at once.
    reference.choose(lighting="path")
    assert reference.settings.lighting == "path"
    lights = []
    for name in ("other", "ramp"):
        begun = len(builders.settings)
        window.workspace.opening.open(Path(name))
        qtbot.waitUntil(lambda name=name: window.workspace.opened.volume.name == name)
        settle(qtbot, window)
        lights.append([settings.lighting for settings in builders.settings[begun:]])
    assert lights == [["soft"], ["soft", "path"]]


def test_the_generators_image_alone_is_as_large_as_its_pane(qtbot, make_window, network):
    window = make_window(size=None)
    window.workspace.reference.choose(lighting="path")
    window.panes.shown = "generator"
    # What is hidden may have no size.
    window.reference.canvas.resize(0, 100)

    def fills(canvas):
        pixels = canvas.image and (canvas.image.width(), canvas.image.height())
        return canvas.width() > 1.5 * canvas.height() and pixels == canvas.pixels

    qtbot.waitUntil(lambda: fills(window.generator.canvas))
    # Nor has one that has just come, while the other, as large as before, is no longer hidden.
    window.reference.canvas.resize(window.generator.canvas.size())
    window.generator.canvas.resize(0, 100)
    window.panes.shown = "reference"
    qtbot.waitUntil(lambda: fills(window.reference.canvas))


def test_a_model_waits_for_no_image_that_is_out_of_sight(qtbot, make_window):
    window = make_window()
    model, client = window.workspace.model, window.generator.client
    # Held back for the reference's image, which is to come first, as at the start.
    model.open(model.folder, model.scene, held=True)
    assert client.text == open_model.LOADING
    window.panes.shown = "generator"
    qtbot.waitUntil(lambda: client.is_settled and client.text == "")


CHOICE = FigureChoice(48, 32, BLACK)


@pytest.fixture
def real_reference(builders, monkeypatch):
    """Have the reference drawn in truth, with a graphics card, where soft light is too slow."""
    # Compiled before a window waits for it.
    for lighting in ("none", "direct", "soft"):
        RaycastRenderer(make_volume(), lighting).render(SceneInputs.of(View(), make_tf()), 8)
    monkeypatch.setattr(opengl, "opengl_name", lambda: "NVIDIA RTX A2000/PCIe/SSE2")
    monkeypatch.setattr(builders, "reference", REAL_BUILDERS.reference)
    monkeypatch.setattr(reference_choices, "slow_lights", lambda _seconds: frozenset({"soft"}))


def fail(*_, **__):
    raise CannotDrawError("VTK cannot draw ramp on this machine ('out of memory'); crop it.")


@pytest.mark.parametrize("place", ["offscreen_window", "render"])
def test_the_ray_caster_draws_and_a_sentence_says_so(
    qtbot, make_window, real_reference, monkeypatch, tmp_path, place
):
    if place == "render":
        monkeypatch.setattr(VtkRenderer, "render", fail)
    else:
        monkeypatch.setattr(vtk_renderer, "offscreen_window", fail)
    window = make_window(model=None, lighting="direct")
    assert not window.errors
    assert "out of memory" in window.reference.detail
    assert "the ray caster draws instead" in window.reference.detail
    window.brightness.set(1.0)
    window.saving.draw(CHOICE, tmp_path / "picture.png")
    qtbot.waitUntil((tmp_path / "picture.png").exists)
    assert np.asarray(Image.open(tmp_path / "picture.png").convert("RGB")).max() > 20
    # What nothing draws is not saved.
    monkeypatch.setattr(RaycastRenderer, "render", fail)
    window.saving.draw(CHOICE, tmp_path / "another.png")
    qtbot.waitUntil(lambda: "out of memory" in window.notice.text)
    assert [each.name for each in tmp_path.iterdir()] == ["picture.png"]


def test_without_a_graphics_card_vtk_draws_where_it_is_chosen_and_next_to_a_generator(
    qtbot, make_window, real_reference, monkeypatch
):
    monkeypatch.setattr(opengl, "opengl_name", lambda: "llvmpipe (LLVM 15.0.6, 256 bits)")
    window, shown = make_window(lighting="direct"), []
    client, choose = window.reference.client, window.workspace.reference.choose
    window.reference.resultShown.connect(shown.append)
    for lighting, name in (("direct", "VTK"), ("none", "VTK"), ("soft", "ray caster")):
        choose(lighting=lighting)
        window.state.set_view(View(azimuth=40.0 + len(shown)))
        qtbot.waitUntil(lambda: client.is_ready and client.is_settled)
        assert shown[-1].image.by.startswith(name)
        assert window.reference.caption.detail.startswith(name)
    # Alone, where nothing is compared with it, the ray caster's faster image stays.
    window.workspace.open_model(None)
    for changes, name in (
        ({"lighting": "direct"}, "ray caster"),
        ({"drawing": "vtk"}, "VTK"),
        ({"drawing": "raycast"}, "ray caster"),
        ({"drawing": "auto"}, "ray caster"),
        # VTK does not draw this light, with or without a graphics card.
        ({"lighting": "soft"}, "ray caster"),
    ):
        choose(**changes)
        is_automatic = changes.get("drawing", "auto") == "auto"
        qtbot.waitUntil(lambda: client.is_ready and client.is_settled)
        assert (shown[-1].image.by, bool(shown[-1].remark)) == (name, is_automatic)
        is_without = is_automatic and "soft" not in changes.values()
        assert ("llvmpipe" in shown[-1].remark) == is_without
