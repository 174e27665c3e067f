from pathlib import Path

import pytest
from ramp import make_volume
from rested_window import open_volume, settle

from app.state.library import KnownModel, Library
from model.scene.scene import Scene


@pytest.fixture(autouse=True)
def shipped(builders, monkeypatch):
    """The ramp has a shipped model, the hill has none."""
    builders.volumes["hill"] = make_volume("hill", top=150.0)
    ramp = builders.volumes["ramp"].fingerprint

    def models_of(_library, fingerprint, remembered):
        return [KnownModel(Path("shipped"), "shipped", "")] if fingerprint == ramp else []

    monkeypatch.setattr(Library, "models_of", models_of)


def test_a_volume_brings_its_shipped_model(qtbot, window, builders):
    assert len(builders.generators) == 1
    assert window.generator.canvas.image is not None
    open_volume(qtbot, window, "hill")
    settle(qtbot, window)
    assert len(builders.generators) == 1
    assert window.generator.canvas.image is None
    # The other volume's model is not kept in memory.
    qtbot.waitUntil(lambda: builders.generators[0].closed)


def test_a_chosen_model_gives_way_to_that_of_another_volume(qtbot, make_window, builders):
    builders.scene = Scene.of(builders.volumes["hill"], image_size=16)
    window = make_window(volume="hill", model=Path("mine"))
    assert window.workspace.model.folder == Path("mine")
    open_volume(qtbot, window, "ramp")
    settle(qtbot, window)
    assert window.workspace.model.folder == Path("shipped")


def test_a_chosen_model_waits_for_its_volume(qtbot, make_window, builders):
    builders.scene = Scene.of(builders.volumes["hill"], image_size=16)
    window = make_window(volume="ramp", model=Path("mine"))
    assert window.workspace.model.folder == Path("mine")
    assert "'hill'" in window.generator.canvas.message
    open_volume(qtbot, window, "hill")
    settle(qtbot, window)
    assert window.workspace.model.folder == Path("mine")
    assert window.generator.canvas.image is not None
