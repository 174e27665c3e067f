from functools import partial

import pytest
from PySide6.QtWidgets import QFileDialog, QMessageBox
from ramp import make_tf, make_volume

from app.window.context import ask_for_place, file_name
from app.window.files import TF_FILTER
from model.scene.transfer_function import TransferFunction


@pytest.fixture
def window(make_window):
    return make_window()


@pytest.fixture
def answer(monkeypatch):
    """What the user chooses in every file dialog; empty cancels."""

    def set_answer(path):
        def file(*_args):
            return str(path), ""

        def folder(*_args):
            return str(path)

        monkeypatch.setattr(QFileDialog, "getOpenFileName", file)
        monkeypatch.setattr(QFileDialog, "getSaveFileName", file)
        monkeypatch.setattr(QFileDialog, "getExistingDirectory", folder)

    return set_answer


def test_files_are_opened_and_saved_unless_that_is_cancelled(
    qtbot, window, answer, builders, tmp_path, monkeypatch
):
    files = window.files
    ask_for_tf = partial(files.ask, "Open TF", TF_FILTER, files.open_transfer_function)
    answer("")
    before = window.state.transfer_function
    for ask in (
        files.ask_and_open,
        partial(files.ask, "Open model", "", files.open_model),
        ask_for_tf,
        files.save_transfer_function,
        lambda: ask_for_place(window.context, "Save", "", (".png",)),
    ):
        ask()
    assert window.state.transfer_function == before
    assert window.notice.text == ""
    assert window.workspace.is_settled
    assert list(tmp_path.iterdir()) == []
    answer(tmp_path / "mine.json")
    window.state.tf_input.set(make_tf(123.0), "edit")
    files.save_transfer_function()
    assert TransferFunction.load(tmp_path / "mine.json") == make_tf(123.0)
    window.state.reset_transfer_function()
    ask_for_tf()
    assert window.state.transfer_function == make_tf(123.0)
    assert window.preferences.settings.last_folder == str(tmp_path)
    assert window.preferences.recent("transfer_functions") == [tmp_path / "mine.json"]
    foreign = tmp_path / "foreign.json"
    answer(foreign)
    for content in ("", "{}", "[1, 2]"):
        foreign.write_text(content)
        window.notice.clear()
        ask_for_tf()
        assert str(foreign) in window.notice.text
        assert window.state.transfer_function == make_tf(123.0)
    answer(tmp_path / "missing" / "tf.json")
    files.save_transfer_function()
    assert "tf.json" in window.notice.text
    # An ending is added, and replaces no file unasked.
    buttons = QMessageBox.StandardButton
    for name in ("other", "other.v2"):
        answer(tmp_path / name)
        path = tmp_path / f"{name}.json"
        path.write_text("mine")
        monkeypatch.setattr(QMessageBox, "question", lambda *_: buttons.No)
        files.save_transfer_function()
        assert path.read_text() == "mine"
        monkeypatch.setattr(QMessageBox, "question", lambda *_: buttons.Yes)
        files.save_transfer_function()
        assert TransferFunction.load(path) == window.state.transfer_function
    window.notice.clear()
    builders.volumes["other"] = make_volume("other", top=300.0)
    answer("other.nrrd")
    with qtbot.waitSignal(window.workspace.volumeStarted):
        files.ask_and_open()
    assert window.state.scalar_range == (100.0, 300.0)
    files.ask("Open model", "", files.open_model)
    assert "no such folder" in window.notice.text
    assert len(builders.generators) == 1


@pytest.mark.parametrize(
    ("name", "expected"),
    [("engine", "engine"), ("CT: head/neck (2)", "CT_head_neck_2"), ("../..", ""), ("", "")],
)
def test_the_volumes_name_becomes_a_files(name, expected):
    assert file_name(name) == expected
