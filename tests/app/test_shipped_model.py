"""Which model the window takes when the user has named none."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot
from ramp import make_volume
from window_fakes import FakeBuilders

from app.window.main_window import MainWindow
from model.scene.scene import Scene

WindowMaker = Callable[..., MainWindow]


@pytest.fixture(autouse=True)
def shipped(builders: FakeBuilders, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The ramp has a shipped model, the hill has none; returns the fingerprints looked up."""
    builders.volumes["hill"] = make_volume("hill", top=150.0)
    ramp = builders.volumes["ramp"].fingerprint
    asked: list[str] = []

    def model_for(fingerprint: str) -> Path | None:
        asked.append(fingerprint)
        return Path("shipped") if fingerprint == ramp else None

    monkeypatch.setattr("app.state.workspace.model_for", model_for)
    return asked


def open_volume(qtbot: QtBot, window: MainWindow, name: str) -> None:
    window.workspace.open_volume(Path(name))
    qtbot.waitUntil(
        lambda: (
            window.workspace.is_settled
            and window.workspace.opened is not None
            and window.workspace.opened.volume.name == name
        )
    )


def test_a_volume_brings_its_shipped_model(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    window = make_window(model=None)
    assert len(builders.generators) == 1
    assert window.generator.canvas.image is not None
    open_volume(qtbot, window, "hill")
    assert len(builders.generators) == 1
    assert window.generator.canvas.image is None
    # The other volume's model is not kept in memory.
    qtbot.waitUntil(lambda: builders.generators[0].closed)


def test_a_model_that_the_user_chose_stays(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    builders.scene = Scene.of(builders.volumes["hill"], image_size=16)
    window = make_window(volume="hill", model=Path("mine"))
    open_volume(qtbot, window, "ramp")
    assert len(builders.generators) == 1
    open_volume(qtbot, window, "hill")
    assert window.generator.canvas.image is not None
