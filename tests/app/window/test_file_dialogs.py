from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QFileDialog
from pytestqt.qtbot import QtBot
from ramp import make_tf, make_volume
from window_fakes import FakeBuilders

from app.window.file_dialogs import FileDialogs
from app.window.main_window import MainWindow
from model.scene.transfer_function import TransferFunction

Answer = Callable[[Path | str], None]


@pytest.fixture
def window(make_window: Callable[..., MainWindow]) -> MainWindow:
    return make_window()


@pytest.fixture
def dialogs(window: MainWindow) -> FileDialogs:
    return window.findChildren(FileDialogs)[0]


@pytest.fixture
def answer(monkeypatch: pytest.MonkeyPatch) -> Answer:
    """What the user chooses in every file dialog; empty cancels."""

    def set_answer(path: Path | str) -> None:
        def file(*_args: object) -> tuple[str, str]:
            return str(path), ""

        def folder(*_args: object) -> str:
            return str(path)

        monkeypatch.setattr(QFileDialog, "getOpenFileName", file)
        monkeypatch.setattr(QFileDialog, "getSaveFileName", file)
        monkeypatch.setattr(QFileDialog, "getExistingDirectory", folder)

    return set_answer


def test_a_tf_saved_and_opened_is_the_same(
    window: MainWindow, dialogs: FileDialogs, answer: Answer, tmp_path: Path
) -> None:
    answer(tmp_path / "mine.json")
    window.state.commit(make_tf(123.0), "edit")
    dialogs.save_transfer_function()
    assert TransferFunction.load(tmp_path / "mine.json") == make_tf(123.0)
    window.state.reset_transfer_function()
    dialogs.open_transfer_function()
    assert window.state.transfer_function == make_tf(123.0)


@pytest.mark.parametrize("content", ["", "{}", "[1, 2]"])
def test_a_foreign_tf_file_is_told_and_nothing_lost(
    window: MainWindow, dialogs: FileDialogs, answer: Answer, tmp_path: Path, content: str
) -> None:
    path = tmp_path / "foreign.json"
    path.write_text(content)
    answer(path)
    before = window.state.transfer_function
    dialogs.open_transfer_function()
    assert str(path) in window.notice.text
    assert window.state.transfer_function == before


def test_a_place_that_cannot_be_written_is_told(
    window: MainWindow, dialogs: FileDialogs, answer: Answer, tmp_path: Path
) -> None:
    answer(tmp_path / "missing" / "tf.json")
    dialogs.save_transfer_function()
    assert "tf.json" in window.notice.text
    window.notice.clear()
    answer(tmp_path / "missing" / "image.png")
    dialogs.save_image(window.generator)
    assert "image.png" in window.notice.text


def test_an_image_is_saved_at_its_own_size(
    window: MainWindow, dialogs: FileDialogs, answer: Answer, tmp_path: Path
) -> None:
    answer(tmp_path / "image")
    dialogs.save_image(window.generator)
    saved = QImage(str(tmp_path / "image.png"))
    assert (saved.width(), saved.height()) == (16, 16)
    assert window.generator.canvas.image is not None
    assert saved.pixelColor(0, 0) == window.generator.canvas.image.pixelColor(0, 0)


@pytest.mark.parametrize("name", ["image", "image.v2"])
def test_an_ending_that_is_added_replaces_no_file(
    window: MainWindow, dialogs: FileDialogs, answer: Answer, tmp_path: Path, name: str
) -> None:
    answer(tmp_path / name)
    path = tmp_path / f"{name}.png"
    path.write_text("mine")
    dialogs.save_image(window.generator)
    assert path.read_text() == "mine"
    assert str(path) in window.notice.text
    path.unlink()
    dialogs.save_image(window.generator)
    assert not QImage(str(path)).isNull()


def test_opening_goes_to_the_workspace(
    qtbot: QtBot,
    window: MainWindow,
    dialogs: FileDialogs,
    answer: Answer,
    builders: FakeBuilders,
) -> None:
    builders.volumes["other"] = make_volume("other", top=300.0)
    answer("other.nrrd")
    with qtbot.waitSignal(window.workspace.volumeStarted):
        dialogs.open_volume()
    assert window.state.scalar_range == (100.0, 300.0)
    with qtbot.waitSignal(window.generator.client.engineReady):
        dialogs.open_model()
    assert len(builders.generators) == 2


def test_cancelling_does_nothing(
    window: MainWindow, dialogs: FileDialogs, answer: Answer, tmp_path: Path
) -> None:
    answer("")
    before = window.state.transfer_function
    for ask in (
        dialogs.open_volume,
        dialogs.open_dicom,
        dialogs.open_model,
        dialogs.open_transfer_function,
        dialogs.save_transfer_function,
        lambda: dialogs.save_image(window.generator),
    ):
        ask()
    assert window.state.transfer_function == before
    assert window.notice.text == ""
    assert window.workspace.is_settled
    assert list(tmp_path.iterdir()) == []
