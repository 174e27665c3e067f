"""The menus of shipped volumes and models, with models that only look like shipped ones."""

from __future__ import annotations

from pathlib import Path

import pytest
from fake_models import make_model
from PySide6.QtWidgets import QMenu
from ramp import make_volume

from app.state import library
from app.window.file_menus import menu_names
from app.window.main_window import MainWindow


def entries(menu: QMenu) -> list[str]:
    return [action.text() for action in menu.actions() if not action.isSeparator()]


def menu_of(window: MainWindow, *titles: str) -> QMenu:
    menu: object = window.top_bar.menu_bar
    for title in titles:
        found = [a.menu() for a in menu.actions() if a.text().replace("&", "") == title]
        menu = found[0]
    assert isinstance(menu, QMenu)
    return menu


@pytest.fixture
def shipped(tmp_path, monkeypatch):
    """A model of the volume "ramp" that ships as a file."""
    model, volume = make_model(tmp_path / "model"), tmp_path / "ramp.nrrd"
    monkeypatch.setattr(library, "shipped_models", lambda: [model])
    monkeypatch.setattr(library, "shipped_volumes", lambda: [volume])
    monkeypatch.setattr(library, "title_of", lambda path: path.stem.title())
    return {"model": model, "volume": volume}


def test_a_sample_model_opens_with_its_volume(qtbot, make_window, builders, shipped, monkeypatch):
    builders.volumes["other"] = make_volume("other", 300.0)
    window = make_window("other", model=None)
    opened: list[Path] = []
    window.workspace.volumeOpened.connect(lambda volume: opened.append(volume.path))
    menu = menu_of(window, "File", "Sample models")
    menu.aboutToShow.emit()
    assert entries(menu) == ["Paper's networks: Ramp, no light"]
    assert menu.actions()[0].toolTip() == "RMSE 0.050."
    menu.actions()[0].trigger()
    qtbot.waitUntil(lambda: window.workspace.model.folder == shipped["model"])
    qtbot.waitUntil(lambda: bool(builders.generators))
    with qtbot.waitSignal(window.workspace.settled):
        pass
    assert [path.name for path in opened] == ["ramp.nrrd"]
    menu.aboutToShow.emit()
    assert menu.actions()[0].isChecked()
    monkeypatch.setattr(library, "shipped_models", list)
    menu.aboutToShow.emit()
    assert entries(menu) == ["None ship with this version"]
    assert not menu.actions()[0].isEnabled()


def test_files_of_one_name_are_told_apart_by_their_folders():
    paths = [Path("/a/engine.nrrd"), Path("/b/engine.nrrd"), Path("/a/fly & co.nrrd")]
    assert menu_names(paths) == ["engine.nrrd  (a)", "engine.nrrd  (b)", "fly && co.nrrd"]
    assert menu_names([]) == []
