from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtWidgets import QPushButton
from rested_window import act_until
from window_fakes import make_volume

from app.window.raw_dialog import UNKNOWN, RawDialog
from app.window.volume_dialogs import ContentsDialog
from model.errors import VolumeError
from model.scene.volume import Content, FileFacts
from model.volume_files import read_volume
from model.volume_files.choice import Choice
from model.volume_files.raw import RawLayout

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
    dialog.tables["array"].setCurrentCell(1, 0)
    dialog.boxes["channel"].setCurrentIndex(2)
    dialog.open_button.click()
    assert chosen == [Choice(array="ids", channel="2")]


def test_what_a_file_holds_is_asked_for_once(qtbot, window, tmp_path, monkeypatch):
    asked = []

    def read(path, choice=None):
        asked.append(choice)
        number = int((choice or Choice()).channel or 0)
        listed = tuple(replace(c, is_read=k == number) for k, c in enumerate(CHANNELS))
        volume = make_volume(f"{path.stem}{number}")
        facts = FileFacts(contents=listed)
        return replace(volume, voxels=volume.voxels + number, file=facts)

    monkeypatch.setattr(window.workspace.opening, "_read_volume", read)

    def asking():
        return [dialog for dialog in window.findChildren(ContentsDialog) if dialog.isVisible()]

    path = tmp_path / "cells.tif"
    path.write_bytes(b"?")
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    (dialog,) = asking()
    dialog.boxes["channel"].setCurrentIndex(2)
    act_until(qtbot, window.workspace.volumeStarted, dialog.open_button.click)
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    # It is not asked for again.
    assert not asking()
    assert asked == [None, Choice(channel="2"), Choice(channel="2")]
    # A choice that is gone gives way.
    asked.clear()

    def refuse(path, choice=None):
        asked.append(choice)
        if choice is not None:
            raise VolumeError(f"{path}: there is no channel '2'; there are 0, 1.")
        return make_volume("other")

    monkeypatch.setattr(window.workspace.opening, "_read_volume", refuse)
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    assert asked == [Choice(channel="2"), None]
    # What is kept is not asked for again, either.
    monkeypatch.setattr(window.workspace.opening, "_read_volume", read)
    asked.clear()
    path = tmp_path / "others.tif"
    path.write_bytes(b"?")
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    buttons = asking()[0].findChildren(QPushButton)
    next(each for each in buttons if each.text() == "Keep what is shown").click()
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    assert not asking()
    assert asked == [None, Choice(channel="0")]


@pytest.fixture
def open_dialog(qtbot, tmp_path):
    """Open the dialog on a smooth volume of 24 x 20 x 16 big-endian values."""
    dialogs = []
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (16, 20, 24)), indexing="ij")
    bytes_ = (30000 * np.exp(-2 * (x * x + y * y + z * z))).astype(">u2").tobytes()

    def opened(name, content=bytes_):
        (tmp_path / name).write_bytes(content)
        dialog = RawDialog(tmp_path / name)
        dialogs.append(dialog)
        qtbot.addWidget(dialog)
        return dialog

    yield opened
    for dialog in dialogs:
        dialog.done(0)


def wait(qtbot, dialog):
    qtbot.waitUntil(lambda: not dialog._previews.is_running)


NAME = "data_24x20x16_ushort_big.raw"


def test_it_begins_with_what_the_name_says_and_every_change_is_checked(qtbot, open_dialog):
    dialog = open_dialog(NAME)
    wait(qtbot, dialog)
    assert dialog.choice() == RawLayout((24, 20, 16), "uint16", "big")
    assert dialog.open_button.isEnabled()
    sizes = [(s.image.width(), s.image.height()) for s in dialog.slices if s.image]
    assert sizes == [(20, 16), (24, 16), (24, 20)]
    dialog.dimension_boxes[2].setValue(17)
    assert not dialog.open_button.isEnabled()
    assert "too few" in dialog.fit.text() and "16 voxels along z" in dialog.fit.text()
    wait(qtbot, dialog)
    first = dialog.slices[0].image
    assert first is not None and first.height() == 17
    dialog.dimension_boxes[2].setValue(16)
    assert dialog.open_button.isEnabled()
    wait(qtbot, dialog)
    right = dialog.slices[1].image
    dialog.order_box.setCurrentIndex(0)
    dialog.order_box.activated.emit(0)
    wait(qtbot, dialog)
    assert dialog.open_button.isEnabled()
    assert dialog.slices[1].image != right


def test_a_file_that_nothing_fits_and_one_that_is_gone(qtbot, open_dialog, tmp_path):
    dialog = open_dialog("prime.raw", b"x" * 1009)
    wait(qtbot, dialog)
    assert dialog.choice() == UNKNOWN and not dialog.open_button.isEnabled()
    assert "1,009 bytes" in dialog.fit.text()
    (tmp_path / "prime.raw").unlink()
    dialog.dimension_boxes[0].setValue(9)
    wait(qtbot, dialog)
    assert "prime.raw: the file cannot be read" in dialog.fit.text()
    assert not dialog.open_button.isEnabled()


def test_a_header_is_skipped(qtbot, open_dialog, tmp_path):
    content = np.arange(4 * 5 * 6, dtype=np.uint16).tobytes()
    dialog = open_dialog("scan_6x5x4_uint16.raw", b"head" * 8 + content)
    wait(qtbot, dialog)
    assert dialog.choice() == RawLayout((6, 5, 4), "uint16", offset=32)
    dialog.offset_box.setValue(0)
    assert "32 bytes too many. A header? It would fit with 32 bytes skipped" in dialog.fit.text()
    dialog.offset_box.setValue(32)
    assert dialog.open_button.isEnabled()
    volume = read_volume(tmp_path / "scan_6x5x4_uint16.raw", raw=dialog.choice())
    assert volume.data_range == (0, 119)
