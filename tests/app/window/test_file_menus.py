from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from fake_models import make_model
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QMessageBox
from ramp import make_tf, make_volume
from rested_window import act_until, notice_buttons, open_volume, settle

from app.state.library import KnownModel, Library
from app.window import files
from app.window.context import ask_for_place, file_name
from app.window.files import TF_FILTER
from app.window.volume_dialogs import PropertiesDialog
from model.scene.scene import Scene
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction
from model.volume_files import read_volume
from model.volume_files.raw import RawLayout


def over(tf, lo, hi):
    return TransferFunction(
        OpacityTF((lo, hi), tf.opacity.modes),
        ColorTF((lo, hi), ((lo, 0.0, 0.0, 0.0), (hi, 1.0, 1.0, 1.0))),
    )


def test_a_tf_is_shown_over_its_range_or_fitted(qtbot, window, tmp_path, builders):
    unit = over(make_tf(0.25), 0.0, 1.0)
    unit.save(tmp_path / "tf.json")
    window.files.open_transfer_function(tmp_path / "tf.json")
    assert window.state.scalar_range == (100.0, 200.0)
    assert window.state.transfer_function.opacity.modes[0].mean == 125.0
    assert "fitted" in window.status.news
    narrow = over(make_tf(150.0), 120.0, 180.0)
    narrow.save(tmp_path / "tf.json")
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.files.open_transfer_function(tmp_path / "tf.json")
    assert window.state.transfer_function == narrow
    opened = window.workspace.opened
    assert opened is not None and opened.volume.scalar_range == (120.0, 180.0)
    assert opened.volume.data_range == (100.0, 200.0)
    act_until(qtbot, window.workspace.rangeChanged, window.state.edits.undo)
    assert window.workspace.opened.volume.scalar_range == (100.0, 200.0)
    # Otherwise all handles lie over one another.
    over(make_tf(151.0), 150.0, 152.0).save(tmp_path / "tf.json")
    axis = window.editor.area.axis
    assert axis.visible == (100.0, 200.0)
    window.files.open_transfer_function(tmp_path / "tf.json")
    places = window.editor.area.axis.places((150.0, 152.0))
    assert 0.0 < places[0] < 0.25 and 0.75 < places[1] < 1.0
    with qtbot.waitSignal(window.workspace.problem):
        window.state.tf_input.set(over(make_tf(), 900.0, 950.0), "edit")
    assert "900" in window.notice.text
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    builders.volumes["other"] = make_volume("other", 300.0)
    for name, expected in (("other", (100.0, 300.0)), ("ramp", (100.0, 200.0))):
        act_until(qtbot, window.workspace.volumeStarted, window.files.open_volume, Path(name))
        assert window.state.scalar_range == expected


def test_a_model_offers_its_volume_and_comes_back_with_it(qtbot, window, builders, tmp_path):
    other = make_volume("other", 300.0)
    builders.volumes["other"], builders.scene = other, Scene.of(other, image_size=16)
    place = tmp_path / "other.nrrd"
    place.touch()
    folder = make_model(tmp_path / "model", "other", 300.0)
    # Left with B, which makes way for the model's image.
    act_until(qtbot, window.workspace.volumeStarted, window.files.open_volume, place)
    window.state.tf_input.compare(True)
    act_until(qtbot, window.workspace.volumeStarted, window.files.open_volume, Path("ramp"))
    window.files.open_model(folder)
    assert "'other'" in window.notice.text
    act_until(qtbot, window.workspace.volumeStarted, notice_buttons(window)["Open both"].click)
    assert window.workspace.model.folder == folder and not window.state.tf_input.compares
    window.state.tf_input.compare(True)
    window.files.open_model(folder)
    assert not window.state.tf_input.compares
    assert window.notice.text == ""
    qtbot.waitUntil(lambda: window.preferences.recent("models") == [folder])
    known = window.preferences.volume(other.fingerprint)
    assert (known.path, known.models) == (str(place), (str(folder),))
    window.files.open_model(tmp_path)
    assert str(tmp_path) in window.notice.text
    assert window.workspace.model.folder == folder
    act_until(qtbot, window.workspace.volumeStarted, window.files.open_volume, Path("ramp"))
    assert window.workspace.model.folder is None
    act_until(qtbot, window.workspace.volumeStarted, window.files.open_volume, place)
    assert window.workspace.model.folder == folder


def test_files_are_opened_as_what_they_are_asked_for_once_and_named_where_they_are_gone(
    qtbot, window, tmp_path, monkeypatch
):
    make_tf(123.0).save(tmp_path / "tf.json")
    window.files.open(tmp_path / "tf.json")
    assert window.state.transfer_function == make_tf(123.0)
    for kind in ("volumes", "models", "transfer_functions"):
        window.files.open_recent(kind, tmp_path / f"{kind}.gone")
        assert f"{kind}.gone" in window.notice.text
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    layout = RawLayout((4, 5, 6), "uint8", spacing=(1.0, 1.0, 2.5))
    asked = []

    def dialog(path, _parent):
        asked.append(path)
        return SimpleNamespace(exec=lambda: True, choice=lambda: layout, deleteLater=list)

    monkeypatch.setattr(files, "RawDialog", dialog)
    used = []

    def read(path, raw=None):
        used.append(raw)
        return replace(make_volume(path.stem), spacing=(1.0, 1.0, 2.5))

    monkeypatch.setattr(window.workspace.opening, "_read_volume", read)
    scan = tmp_path / "scan.raw"
    scan.write_bytes(bytes(120))
    for _ in range(2):
        act_until(qtbot, window.workspace.volumeStarted, window.files.open, scan)
    assert asked == [scan]
    assert used == [layout, layout]


def test_spacing_and_stretch_are_typed_and_kept_with_the_file(qtbot, make_window, tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, np.arange(120.0).reshape(4, 5, 6))
    window = make_window(model=None)
    opened = partial(qtbot.waitSignal, window.workspace.volumeStarted)
    window.workspace.opening._read_volume = read_volume
    with opened():
        window.files.open(path)
    tf = over(make_tf(40.0), 0.0, 119.0)
    window.state.tf_input.set(tf, "edit")
    window.files.show_properties()
    dialog = window.findChild(PropertiesDialog)
    for text, is_good in (("1, 1", False), ("0.5, 0.5, 0", False), ("0.5, 0.5, 2 um", True)):
        dialog.spacing.setText(text)
        dialog.spacing.textEdited.emit(text)
        assert dialog.apply.isEnabled() == is_good
        assert (dialog.problem.text() == "") == is_good
    with opened():
        QTest.keyClick(dialog.spacing, Qt.Key.Key_Return)
    volume = window.workspace.opened.volume
    assert (volume.spacing, volume.file.spacing_unit) == ((0.5, 0.5, 2.0), "um")
    assert "was typed" in volume.notes[-1]
    assert window.state.transfer_function == tf
    with opened():
        window.files.open(path)
    assert window.workspace.opened.volume.spacing == (0.5, 0.5, 2.0)
    window.files.show_properties()
    dialog = window.findChildren(PropertiesDialog)[-1]
    dialog.stretch.setText("3")
    dialog.stretch.textEdited.emit("3")
    with opened():
        dialog.apply.click()
    for _ in range(2):
        opened_volume = window.workspace.opened.volume
        assert (opened_volume.spacing, opened_volume.file.stretch) == ((0.5, 0.5, 6.0), 3.0)
        with opened():
            window.files.open(path)


def test_files_are_opened_and_saved_unless_that_is_cancelled(
    qtbot, make_window, builders, tmp_path, monkeypatch
):
    def answer(path):
        """Have the user choose this in every file dialog; nothing cancels it."""
        for name in ("getOpenFileName", "getSaveFileName"):
            monkeypatch.setattr(QFileDialog, name, lambda *_: (str(path), ""))
        monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: str(path))

    window = make_window()
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
    act_until(qtbot, window.workspace.volumeStarted, files.ask_and_open)
    assert window.state.scalar_range == (100.0, 300.0)


def test_the_volumes_name_becomes_a_files():
    found = [file_name(name) for name in ("engine", "CT: head/neck (2)", "../..")]
    assert found == ["engine", "CT_head_neck_2", ""]


@pytest.fixture
def shipped(builders, monkeypatch):
    """The ramp has a shipped model, the hill has none."""
    builders.volumes["hill"] = make_volume("hill", top=150.0)
    ramp = builders.volumes["ramp"].fingerprint

    def models_of(_library, fingerprint, remembered):
        return [KnownModel(Path("shipped"), "shipped", "")] if fingerprint == ramp else []

    monkeypatch.setattr(Library, "models_of", models_of)


def test_a_volume_brings_its_shipped_model(qtbot, make_window, shipped, builders):
    window = make_window(model=None)
    assert len(builders.generators) == 1
    assert window.generator.canvas.image is not None
    open_volume(qtbot, window, "hill")
    settle(qtbot, window)
    assert len(builders.generators) == 1
    assert window.generator.canvas.image is None
    # The other volume's model is not kept in memory.
    qtbot.waitUntil(lambda: builders.generators[0].closed)


def test_a_chosen_model_waits_for_its_volume_and_gives_way_to_that_of_another(
    qtbot, make_window, shipped, builders
):
    builders.scene = Scene.of(builders.volumes["hill"], image_size=16)
    window = make_window(volume="ramp", model=Path("mine"))
    assert window.workspace.model.folder == Path("mine")
    assert window.panes.images == [window.reference]
    open_volume(qtbot, window, "hill")
    settle(qtbot, window)
    assert window.workspace.model.folder == Path("mine")
    assert window.generator.canvas.image is not None
    open_volume(qtbot, window, "ramp")
    settle(qtbot, window)
    assert window.workspace.model.folder == Path("shipped")
