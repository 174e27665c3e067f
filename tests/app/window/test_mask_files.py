"""Pieces and masks in the window: found at a click, shown, undone, kept, saved and opened."""

import numpy as np
import pytest
import SimpleITK
from mouse_events import LEFT
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QFileDialog, QPushButton
from rested_window import act_until, open_volume

from app.state.preferences import Preferences
from app.window.main_window import MainWindow
from app.window.mask_files import LabelsDialog
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import FileFacts, Volume
from model.volume_files.masks import read_mask

RANGE = (0.0, 200.0)
TF = TransferFunction(
    OpacityTF(RANGE, (GaussianMode(100.0, 30.0, 0.9), GaussianMode(200.0, 20.0, 0.9))),
    ColorTF(RANGE, ((0.0, 1.0, 1.0, 1.0),)),
)


def blocks(shape=(12, 12, 12)):
    """A block on the left and one on the right, as one looks from -y."""
    voxels = np.zeros(shape, np.uint8)
    voxels[3:9, 3:9, 1:5] = 100
    voxels[3:9, 3:9, 7:11] = 200
    facts = FileFacts(space="LPS", directions=tuple(map(tuple, np.eye(3))), spacing_unit="mm")
    return Volume(voxels, name="blocks", file=facts)


@pytest.fixture
def window(qtbot, builders, tmp_path):
    return opened(qtbot, builders, tmp_path)


def opened(qtbot, builders, tmp_path):
    """A window as the next run would open it."""
    builders.volumes["blocks"] = blocks()
    (tmp_path / "blocks").touch()
    window = MainWindow(builders.make(), preferences=Preferences(tmp_path / "kept"))
    qtbot.addWidget(window)
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, tmp_path / "blocks")
    window.show()
    qtbot.waitExposed(window)
    window.state.tf_input.set(TF)
    window.state.set_view(View(0.0, 0.0))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    return window


def click(qtbot, window, x, pieces=1):
    canvas = window.reference.canvas
    rect, finder = canvas.image_rect, window.workspace.pieces
    at = QPoint(round(rect.left() + x * rect.width()), rect.center().y())
    QTest.mouseClick(canvas, LEFT, pos=at)
    qtbot.waitUntil(lambda: len(finder.pieces) == pieces)
    return window.sensitivity.labels[1]


def shown(window):
    mask = window.state.inputs.mask
    return None if mask is None else mask.shown


def is_left(mask):
    return mask[3:9, 3:9, 1:5].all() and not mask[3:9, 3:9, 7:11].any()


def test_a_piece_is_shown_alone_or_cut_away_and_each_is_one_edit(qtbot, window):
    label = click(qtbot, window, 0.42)
    qtbot.waitUntil(lambda: "144 mm³" in label.text.text())
    label.text.linkActivated.emit("a0")
    assert is_left(shown(window))
    assert label.isVisible()
    qtbot.waitUntil(lambda: "masked" in window.reference.detail)
    undo = window.state.edits
    assert undo.stack.undoText() == "isolate piece"
    undo.undo()
    assert shown(window) is None
    click(qtbot, window, 0.58).text.linkActivated.emit("c0")
    assert is_left(shown(window)) and shown(window)[0, 0, 0]
    # What is cut away is no place that could be clicked.
    click(qtbot, window, 0.57, pieces=0)
    # The other block, too: then nothing would be left of what shows, but air.
    click(qtbot, window, 0.42).text.linkActivated.emit("a0")
    window.state.show_all_voxels()
    assert shown(window) is None and undo.stack.undoText() == "show all voxels"
    undo.undo()
    assert is_left(shown(window))


def test_a_mask_is_there_in_the_next_run_and_in_sessions(qtbot, window, builders, tmp_path):
    click(qtbot, window, 0.42).text.linkActivated.emit("a0")
    mask, session = window.state.inputs.mask, tmp_path / "a.tfscope"
    window.sessions.save(session)
    assert read_mask(tmp_path / "a.mask.nrrd", blocks()) == mask
    window.close()
    window = opened(qtbot, builders, tmp_path)
    assert window.state.inputs.mask == mask
    # Another volume has none, and the first one has its own again.
    builders.volumes["other"] = blocks((12, 12, 13))
    open_volume(qtbot, window, "other")
    assert shown(window) is None
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, tmp_path / "blocks")
    window.state.show_all_voxels()
    # A session brings it back; what was before it has none, and it is kept for the next run.
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, session)
    assert window.state.inputs.mask == mask
    before = tmp_path / "kept" / "before_session.tfscope"
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, before)
    assert shown(window) is None
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, session)
    (tmp_path / "a.mask.nrrd").unlink()
    window.close()
    window = opened(qtbot, builders, tmp_path)
    assert window.state.inputs.mask == mask
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, session)
    assert shown(window) is None
    assert "All voxels are shown" in window.notice.text and "no such file" in window.notice.text


def test_masks_are_saved_and_opened(qtbot, window, tmp_path, monkeypatch):
    click(qtbot, window, 0.42).text.linkActivated.emit("a0")
    mask, files = window.state.inputs.mask, window.mask_files
    monkeypatch.setattr(
        QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / "mask.nii.gz"), "")
    )
    files.ask_and_save()
    window.state.show_all_voxels()
    files.open(tmp_path / "mask.nii.gz")
    qtbot.waitUntil(lambda: window.state.inputs.mask == mask)
    assert window.state.edits.stack.undoText() == "open mask"


def open_labels(window, path, labels):
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(labels), str(path))
    window.mask_files.open(path)


def test_some_labels_are_chosen(qtbot, window, tmp_path):
    labels = np.zeros((12, 12, 12), np.uint8)
    labels[..., 4:8], labels[..., 8:] = 1, 2
    open_labels(window, tmp_path / "labels.nrrd", labels)
    qtbot.waitUntil(lambda: bool(window.findChildren(LabelsDialog)))
    (dialog,) = window.findChildren(LabelsDialog)
    assert dialog.chosen == [1, 2]
    dialog.list.item(0).setCheckState(Qt.CheckState.Unchecked)
    dialog.accept()
    np.testing.assert_array_equal(shown(window), labels == 2)


def test_a_mask_of_another_grid_is_offered_as_resampled_or_refused(qtbot, window, tmp_path):
    labels = np.zeros((12, 12, 6), np.uint8)
    labels[..., 2:] = 1
    open_labels(window, tmp_path / "half.nrrd", labels)
    qtbot.waitUntil(lambda: "another grid" in window.notice.text)
    assert shown(window) is None
    buttons = window.notice.findChildren(QPushButton)
    next(button for button in buttons if button.text() == "Resample it").click()
    assert shown(window)[..., 2:6].all() and not shown(window)[..., [0, 1, 6]].any()
    assert window.notice.text == ""
    window.state.show_all_voxels()
    scan = np.arange(12**3, dtype=np.float32).reshape(12, 12, 12)
    open_labels(window, tmp_path / "scan.nrrd", np.concatenate([scan, scan + 1e4, scan + 2e4]))
    qtbot.waitUntil(lambda: "which are no labels" in window.notice.text)
    assert shown(window) is None
