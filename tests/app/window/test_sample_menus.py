"""The menus of shipped volumes and models, with models that only look like shipped ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from fake_models import make_model
from PySide6.QtWidgets import QMenu
from pytestqt.qtbot import QtBot
from ramp import make_volume
from window_fakes import FakeBuilders

from app.state import library
from app.window.main_window import MainWindow
from model.networks.size import NetworkSize

WindowMaker = Callable[..., MainWindow]


def entries(menu: QMenu) -> list[str]:
    return [action.text() for action in menu.actions() if not action.isSeparator()]


def menu_of(window: MainWindow, *titles: str) -> QMenu:
    menu: object = window.top_bar.menu_bar
    for title in titles:
        found = [a.menu() for a in menu.actions() if a.text().replace("&", "") == title]  # type: ignore[attr-defined]
        menu = found[0]
    assert isinstance(menu, QMenu)
    return menu


@pytest.fixture
def shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """One model of each architecture, of the volume "ramp" that ships as a file."""
    size = {"width": 0.25, "opacity_size": 16, "image_size": 64}
    folders = {
        architecture: make_model(
            tmp_path / architecture,
            size=vars(NetworkSize(**size, architecture=architecture)),  # type: ignore[arg-type]
        )
        for architecture in ("paper", "refined")
    }
    volume = tmp_path / "ramp.nrrd"
    monkeypatch.setattr(library, "shipped_models", lambda: sorted(folders.values()))
    monkeypatch.setattr(library, "shipped_volumes", lambda: [volume])
    monkeypatch.setattr(library, "title_of", lambda path: path.stem.title())
    return {**folders, "volume": volume}


def test_a_sample_model_opens_with_its_volume(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders, shipped: dict[str, Path]
) -> None:
    builders.volumes["other"] = make_volume("other", 300.0)
    window = make_window("other", model=None)
    opened: list[Path] = []
    window.workspace.volumeOpened.connect(lambda volume: opened.append(volume.path))
    menu = menu_of(window, "File", "Sample models", "The paper's networks")
    menu.aboutToShow.emit()
    assert entries(menu) == ["Ramp, no light"]
    assert menu.actions()[0].toolTip() == "It pays."
    menu.actions()[0].trigger()
    qtbot.waitUntil(lambda: window.workspace.model == shipped["paper"])
    qtbot.waitUntil(lambda: bool(builders.generators))
    with qtbot.waitSignal(window.workspace.settled):
        pass
    assert [path.name for path in opened] == ["ramp.nrrd"]
    menu.aboutToShow.emit()
    assert menu.actions()[0].isChecked()


def test_a_kind_of_model_that_does_not_ship_is_said_so(
    make_window: WindowMaker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(library, "shipped_models", list)
    menu = menu_of(make_window(), "File", "Sample models", "The paper's networks")
    menu.aboutToShow.emit()
    assert entries(menu) == ["None ship with this version"]
    assert not menu.actions()[0].isEnabled()


def test_the_start_shows_the_declared_architecture(
    shipped: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from app.state.preferences import Preferences
    from model.networks.card import load_card

    fingerprint = load_card(shipped["paper"]).scene.volume_fingerprint
    found = library.Library(Preferences())
    for first in ("refined", "paper"):
        monkeypatch.setattr(library, "START_ARCHITECTURE", first)
        assert found.models_of(fingerprint)[0].folder == shipped[first]
