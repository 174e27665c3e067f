from dataclasses import replace

import pytest
from PySide6.QtWidgets import QPushButton
from rested_window import act_until
from window_fakes import make_volume

from app.window.volume_dialogs import ContentsDialog
from model.errors import VolumeError
from model.scene.volume import Content, FileFacts
from model.volume_files.choice import Choice

ARRAYS = (
    Content("array", "density", (4, 5, 6), "float32", 480, True),
    Content("array", "ids", (5, 6, 7), "int64", 1680),
)
CHANNELS = tuple(Content("channel", str(k), (4, 5, 6), "uint8", 120, k == 0) for k in range(3))


def test_what_is_shown_is_chosen_at_first(qtbot):
    chosen = []
    dialog = ContentsDialog("a.vti", ARRAYS + CHANNELS, chosen.append)
    qtbot.addWidget(dialog)
    assert dialog.choice() == Choice(array="density", channel="0")
    assert not dialog.open_button.isEnabled()
    table = dialog.tables["array"]
    words = [table.item(1, column).text() for column in range(4)]
    assert words == ["ids", "5 × 6 × 7", "int64", "1.6 KiB"]

    dialog.tables["array"].setCurrentCell(1, 0)
    dialog.boxes["channel"].setCurrentIndex(2)
    dialog.open_button.click()
    assert chosen == [Choice(array="ids", channel="2")]


@pytest.fixture
def several(window, monkeypatch):
    """Have volumes read of a file with three channels; what was asked for."""
    asked = []

    def read(path, choice=None):
        asked.append(choice)
        number = int((choice or Choice()).channel or 0)
        listed = tuple(replace(c, is_read=k == number) for k, c in enumerate(CHANNELS))
        volume = make_volume(f"{path.stem}{number}")
        facts = FileFacts(contents=listed)
        return replace(volume, voxels=volume.voxels + number, file=facts)

    monkeypatch.setattr(window.workspace.opening, "_read_volume", read)
    return asked


def test_what_a_file_holds_is_asked_for_once(qtbot, window, several, tmp_path, monkeypatch):

    def asking():
        return [dialog for dialog in window.findChildren(ContentsDialog) if dialog.isVisible()]

    path, read = tmp_path / "cells.tif", window.workspace.opening._read_volume
    path.write_bytes(b"?")
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    (dialog,) = asking()
    dialog.boxes["channel"].setCurrentIndex(2)
    act_until(qtbot, window.workspace.volumeStarted, dialog.open_button.click)
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    # It is not asked for again.
    assert not asking()
    assert several == [None, Choice(channel="2"), Choice(channel="2")]
    # A choice that is gone gives way.
    several.clear()

    def refuse(path, choice=None):
        several.append(choice)
        if choice is not None:
            raise VolumeError(f"{path}: there is no channel '2'; there are 0, 1.")
        return make_volume("other")

    monkeypatch.setattr(window.workspace.opening, "_read_volume", refuse)
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    assert several == [Choice(channel="2"), None]
    # What is kept is not asked for again, either.
    monkeypatch.setattr(window.workspace.opening, "_read_volume", read)
    several.clear()
    path = tmp_path / "others.tif"
    path.write_bytes(b"?")
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    buttons = asking()[0].findChildren(QPushButton)
    next(each for each in buttons if each.text() == "Keep what is shown").click()
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    assert not asking()
    assert several == [None, Choice(channel="0")]
