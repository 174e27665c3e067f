"""Compact volumes saved from the window: the file opens as it was seen; cancelling leaves none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot
from ramp import make_volume
from window_fakes import FakeBuilders

from app.window.compact_dialog import CompactChoice, CompactDialog
from app.window.main_window import MainWindow
from model.errors import VolumeError
from model.scene.view import View
from model.volume_files import read_volume

WindowMaker = Callable[..., MainWindow]
SMALL = CompactChoice(0.05, None)


@pytest.fixture
def window(make_window: WindowMaker) -> MainWindow:
    return make_window(model=None)


def test_the_open_volume_is_saved_with_its_tf_and_view(
    qtbot: QtBot, window: MainWindow, tmp_path: Path
) -> None:
    place = tmp_path / "a.tfvolume"
    window.state.set_view(View(33.0, 5.0))
    window.compact.write(SMALL, place)
    assert window.compact.progress is not None
    qtbot.waitUntil(lambda: "Saved" in window.status.news, timeout=20_000)
    assert window.compact.progress is None and not window.compact.work.is_running
    copy, opened = read_volume(place), window.workspace.opened
    assert opened is not None and copy.dimensions == opened.volume.dimensions
    assert copy.file.tf == window.state.transfer_function
    assert copy.file.view == window.state.view
    assert "MB, " in window.status.news
    assert "compact" not in window.reference.status


def test_a_compressed_copy_says_what_it_is(
    qtbot: QtBot, make_window: WindowMaker, builders: FakeBuilders
) -> None:
    volume = make_volume()
    facts = replace(volume.file, is_lossy=True, view=View(12.0, 34.0))
    builders.volumes["copy"] = replace(volume, file=facts)
    window = make_window("copy", model=None)
    qtbot.waitUntil(lambda: "compact" in window.reference.status, timeout=20_000)
    assert window.state.view == View(12.0, 34.0)


def test_cancelling_leaves_no_file(qtbot: QtBot, window: MainWindow, tmp_path: Path) -> None:
    window.compact.write(CompactChoice(None, 0.001), tmp_path / "a.tfvolume")
    progress = window.compact.progress
    assert progress is not None
    progress.findChild(QPushButton).click()
    assert window.status.news == "Saving was cancelled."
    qtbot.waitUntil(lambda: not window.compact.work.is_running, timeout=20_000)
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_saved_is_told(
    qtbot: QtBot, window: MainWindow, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise VolumeError("0.0001 MB leave nothing of so many voxels; give at least 1 MB.")

    monkeypatch.setattr("app.state.compact_work.save_compact", refuse)
    window.compact.write(SMALL, tmp_path / "a.tfvolume")
    qtbot.waitUntil(lambda: not window.compact.work.is_running, timeout=20_000)
    assert "give at least 1 MB" in window.notice.text
    assert window.compact.progress is None


def test_the_dialog_asks_for_one_of_size_and_error(qtbot: QtBot) -> None:
    dialog = CompactDialog(1_000_000, 2_000_000)
    qtbot.addWidget(dialog)
    assert dialog.choice() == CompactChoice(None, 0.004)
    assert not dialog.size_box.isEnabled()
    dialog.by_size.click()
    assert dialog.choice() == CompactChoice(0.062, None)
    assert dialog.size_box.isEnabled() and not dialog.error_box.isEnabled()
