from pathlib import Path

import numpy as np
import pytest
from ramp import make_volume
from rested_window import settle

from app.engines.requests import VisibilityRequest
from app.state import generator_work
from app.state.generator_work import PATH_TITLE
from model.rendering.path_tracing import denoising
from model.scene.view import View


@pytest.fixture(autouse=True)
def network(monkeypatch):
    monkeypatch.setattr(denoising, "installed", lambda: True)
    monkeypatch.setattr(generator_work, "PATH_LIGHT", Path(__file__))


def test_it_draws_while_the_light_is_path_traced(qtbot, make_window, builders, monkeypatch):
    window = make_window()
    reference = window.workspace.reference
    model = builders.generators[-1]
    assert window.generator.caption.title == "Generator"
    reference.choose(lighting="path")
    settle(qtbot, window)
    assert window.generator.caption.title == PATH_TITLE
    assert "serves all volumes" in window.workspace.model.errors
    # One engine for each pane, of one sample and of many.
    samples = sorted(each.samples for each in builders.settings if each.lighting == "path")
    assert samples == [1, 64]
    assert window.workspace.model.lighting == "path"
    assert window.workspace.sensitivity.exact_source == "surrogate"
    assert "Trained with" not in window.generator.hint
    # The model answers nothing meanwhile.
    assert window.workspace.latent.model is None
    asked = len(model.requests)
    window.state.move_view(window.state.view)
    window.state.finish_view()
    settle(qtbot, window)
    assert len(model.requests) == asked
    reference.choose(lighting="none")
    settle(qtbot, window)
    assert window.generator.caption.title == "Generator"
    assert builders.generators[-1] is not model
    assert window.workspace.sensitivity.exact_source == "exact"
    assert window.workspace.latent.model is not None
    # Without the network or the denoiser the model stays.
    monkeypatch.setattr(generator_work, "PATH_LIGHT", Path("missing"))
    reference.choose(lighting="path")
    settle(qtbot, window)
    assert window.generator.caption.title == "Generator"
    assert "Trained with no light" in window.generator.hint
    monkeypatch.setattr(generator_work, "PATH_LIGHT", Path(__file__))
    reference.choose(denoises=False)
    settle(qtbot, window)
    assert window.generator.caption.title == "Generator"
    # And without a model there is one pane still.
    window.workspace.open_model(None)
    reference.choose(denoises=True)
    settle(qtbot, window)
    assert not window.generator.isVisible()


def test_live_questions_follow_live_images_and_leave_time_for_them(
    qtbot, make_window, builders, monkeypatch
):
    window = make_window()
    window.workspace.reference.choose(lighting="path")
    settle(qtbot, window)
    inputs, drawn = window.state.inputs, np.full((16, 16, 4), 0.5, np.float32)
    for truth, note in ((drawn, ""), (drawn + np.float32(0.1), "error .100")):
        window.generator.imageShown.emit(inputs, drawn)
        window.reference.imageShown.emit(inputs, truth)
        assert window.generator.note == note
    qtbot.waitUntil(lambda: bool(window.workspace.sensitivity.regions))
    asked = builders.analysts[-1].others

    def live():
        return sum(each.quality.live for each in asked if isinstance(each, VisibilityRequest))

    before = live()
    for azimuth in range(20):
        window.state.move_view(View(azimuth=float(azimuth)))
    # No image has come yet.
    assert live() == before
    qtbot.waitUntil(lambda: live() > before)
    window.state.finish_view()
    settle(qtbot, window)
    assert live() <= before + 2


def test_a_volume_that_was_seen_in_path_traced_light_opens_in_a_quicker_one(
    qtbot, make_window, builders
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


def test_the_generators_image_alone_is_as_large_as_its_pane(qtbot, make_window):
    window = make_window(size="pane")
    window.workspace.reference.choose(lighting="path")
    window.panes.show_images("generator")
    # What is hidden may have no size.
    window.reference.canvas.resize(0, 100)

    def fills(canvas):
        pixels = canvas.image and (canvas.image.width(), canvas.image.height())
        return canvas.width() > 1.5 * canvas.height() and pixels == canvas.pixels

    qtbot.waitUntil(lambda: fills(window.generator.canvas))
    # Nor has one that has just come, while the other, as large as before, is no longer hidden.
    window.reference.canvas.resize(window.generator.canvas.size())
    window.generator.canvas.resize(0, 100)
    window.panes.show_images("reference")
    qtbot.waitUntil(lambda: fills(window.reference.canvas))
