"""Pieces and masks in the window: found at a click, shown, undone, kept, saved and opened."""

import time
from dataclasses import replace

import numpy as np
import pytest
import SimpleITK
from mouse_events import LEFT, action
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QPushButton
from rested_window import act_until, open_volume, saved_figure, settle

from app.window.context import VOLUME_FILTER
from app.window.figure import FigureChoice
from app.window.volume_dialogs import LabelsDialog
from model.errors import TfscopeError
from model.rendering.scale_bar import volume_text
from model.scene.crop import CropBox
from model.scene.mask import Mask
from model.scene.orientation import corners
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import Projection, View
from model.scene.volume import FileFacts, Volume
from model.volume_files.masks import read_mask, write_mask

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
    return Volume(voxels, name="blocks", file=FileFacts(spacing_unit="mm"))


@pytest.fixture
def window(qtbot, builders, start_again, tmp_path):
    builders.volumes["blocks"] = blocks()
    (tmp_path / "blocks").touch()
    return opened(qtbot, start_again, tmp_path)


def opened(qtbot, start_again, tmp_path):
    """A window as the next run would open it."""
    window = start_again(tmp_path / "blocks")
    window.show()
    qtbot.waitExposed(window)
    window.state.tf_input.set(TF)
    window.state.set_view(View(0.0, 0.0))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    return window


def click(qtbot, window, x, button=LEFT, pieces=1):
    canvas = window.reference.canvas
    rect, finder = canvas.image_rect, window.workspace.pieces
    at = QPoint(round(rect.left() + x * rect.width()), rect.center().y())
    QTest.mouseClick(canvas, button, pos=at)
    # The first search loads SciPy.
    qtbot.waitUntil(lambda: len(finder.pieces) == pieces)
    label = window.sensitivity.labels[1]
    qtbot.waitUntil(lambda: "href" in label.text.text())
    return label


def shown(window):
    return window.state.inputs.mask and window.state.inputs.mask.shown


def is_left(mask):
    return mask[3:9, 3:9, 1:5].all() and not mask[3:9, 3:9, 7:11].any()


def test_a_piece_is_shown_alone_or_cut_away_and_each_is_one_edit(qtbot, window):
    label = click(qtbot, window, 0.42)
    qtbot.waitUntil(lambda: "144 of 288 mm³" in label.text.text())
    # The text grows when pieces are known, and must not move the button.
    assert label.button.geometry().right() < label.text.x()
    # Nor do its links move in it while the same values come again after a turn.
    for azimuth in (5.0, 0.0):
        before, text = label.size(), label.text.text()
        window.state.set_view(View(azimuth, 0.0))
        assert "href" in text.partition("%")[0] and label.text.text() == text
        assert label.size() == before and label.dim.isEnabled()
        qtbot.waitUntil(lambda: not window.workspace.pieces.is_searching)
        assert not label.dim.isEnabled()
    place = label.pos()
    label.text.linkActivated.emit("a0")
    assert is_left(shown(window))
    assert label.isVisible() and label.pos() == place
    qtbot.waitUntil(lambda: "masked" in window.reference.caption.detail)
    undo = window.state.edits
    assert undo.stack.undoText() == "isolate connected voxels"
    # It is what fits: its visible cells, and along x its edge, as the other block lies behind.
    window.state.set_reach((1.2, 1.0))
    window.slices.fit()
    box = corners(CropBox((1 / 12, 3 / 12, 3 / 12), (5 / 11, 9 / 12, 9 / 12)))
    places = Projection(window.state.view, window.state.proportions).places(box)
    assert places.min(axis=0) == pytest.approx(-places.max(axis=0))
    window.state.set_view(View(0.0, 0.0))
    undo.undo()
    assert shown(window) is None
    # By keys where the image has the focus, and by Tab from there to the links.
    label = click(qtbot, window, 0.58)
    for area in (window.editor.area.widget, window.reference.canvas):
        assert shown(window) is None
        area.setFocus()
        QTest.keyClick(window, Qt.Key.Key_I)
    assert shown(window) is not None and not is_left(shown(window))
    undo.undo()
    # Links leave with what they were about.
    label = click(qtbot, window, 0.58)
    window.state.mask_input.set(Mask.of(blocks().voxels == 100))
    qtbot.waitUntil(lambda: "href" not in label.text.text())
    undo.undo()
    # The right button asks for the same values, and opens the menu.
    label = click(qtbot, window, 0.58, Qt.MouseButton.RightButton)
    menu = QApplication.activePopupWidget()
    assert action(window, "Isolate connected voxels") in menu.actions()
    menu.close()
    # Until then the label is written anew.
    qtbot.waitUntil(lambda: "%" in label.text.text())
    window.reference.canvas.setFocus()
    for key in (*3 * [Qt.Key.Key_Tab], Qt.Key.Key_Return):
        QTest.keyClick(QApplication.focusWidget(), key)
    assert is_left(shown(window)) and shown(window)[0, 0, 0]
    # While sensitivities are hidden nothing is found; it is found once they are shown again.
    click(qtbot, window, 0.42)
    window.sensitivity_state.choose(shown=False)
    window.state.show_all_voxels()
    finder = window.workspace.pieces
    assert not finder.pieces
    window.sensitivity_state.choose(shown=True)
    qtbot.waitUntil(lambda: len(finder.pieces) == 1)
    # Nor do colours have others.
    window.state.tf_input.set(TransferFunction(TF.opacity, ColorTF(RANGE, ((0.0, 0.0, 0.0, 1.0),))))
    assert len(finder.pieces) == 1
    undo.undo()
    assert shown(window) is None and undo.stack.undoText() == "show all voxels"
    undo.undo()
    assert is_left(shown(window))


def test_the_values_that_are_listed_at_a_place_have_their_piece(qtbot, window, builders):
    voxels = blocks().voxels.copy()
    voxels[3:9, 3:9, 1:5], voxels[3:9, 3:9, 5:7] = 48, 200
    builders.volumes["touching"] = Volume(voxels)
    open_volume(qtbot, window, "touching")
    # One flank of the TF has the values of both blocks.
    ramp = OpacityTF(RANGE, points=((20.0, 0.0), (200.0, 0.5)))
    window.state.tf_input.set(replace(TF, opacity=ramp))
    window.state.set_view(View(0.0, 0.0))
    label = click(qtbot, window, 0.42, pieces=2)
    text = label.text.text()
    (listed,) = [row for row in text.split("<tr>") if "100 %" in row]
    assert f"Connected {listed.split('</td>')[0][4:]}</td>" in text
    first, second = window.workspace.pieces.pieces
    assert (first.count, second.count) == (6**2 * 10, 6**2 * 4)
    # Values that are in no row are said to be the TF's.
    window.workspace.pieces.pieces = first, replace(second, values=(20.0, 200.0))
    label.refresh()
    assert "Connected peak of the TF, 20 to 200" in label.text.text()
    # The place stays on the block while the view is moved and turned.
    view, asked = window.state.view, window.sensitivity_state
    window.state.set_view(replace(view, pan_x=view.pan_x + 0.2))
    assert asked.place == pytest.approx((0.52, 0.5), abs=0.02)
    window.state.set_view(replace(view, azimuth=180.0))
    assert 0.53 < asked.place[0] < 0.6
    settle(qtbot, window)
    qtbot.waitUntil(lambda: len(window.workspace.pieces.pieces) == 2)
    assert window.workspace.pieces.pieces[1].count == second.count


def test_keys_in_a_slice_take_the_piece_under_the_mouse_or_at_the_cross_hair(qtbot, window):
    window.slices.toggle()
    view = window.slices.column.views[0]
    view.setFocus()
    qtbot.waitUntil(view.hasFocus)
    for key in (Qt.Key.Key_I, Qt.Key.Key_X):
        # What was clicked in the image is still sought.
        window.sensitivity_state.pick((0.58, 0.5))
        left, right = (3 / 11, 0.5, 0.5), (8 / 11, 0.5, 0.5)
        is_isolated = key == Qt.Key.Key_I
        window.slices.state.move(right if is_isolated else left)
        window.slices.state.hovered.emit(left if is_isolated else None)
        QTest.keyClick(view, key)
        qtbot.waitUntil(lambda: shown(window) is not None)
        assert is_left(shown(window)) == is_isolated
        window.state.edits.undo()


def test_the_next_run_and_sessions_have_a_mask(
    qtbot, window, builders, start_again, tmp_path, monkeypatch
):
    click(qtbot, window, 0.42).text.linkActivated.emit("a0")
    mask, session = window.state.inputs.mask, tmp_path / "a.tfscope"
    running, most = [], []

    def write(*args):
        running.append(args)
        most.append(len(running))
        time.sleep(0.05)
        write_mask(*args)
        running.pop()

    def fail(*_):
        time.sleep(0.05)
        raise TfscopeError("The disk is full.")

    # What fails while the window closes is said, and it stays.
    monkeypatch.setattr("app.window.sessions.write_mask", fail)
    window.sessions.save(session)
    assert not window.close() and window.isVisible()
    assert window.notice.text == "The disk is full."
    monkeypatch.setattr("app.window.sessions.write_mask", write)
    # Again before the first one is written: one after the other.
    window.sessions.save(session)
    window.sessions.save(session)
    assert "Saved" not in window.status.news
    window.sessions.join()
    qtbot.waitUntil(lambda: window.status.news == f"Saved {session}.")
    assert most == [1, 1]
    assert read_mask(tmp_path / "a.tfscope.mask.nrrd", blocks()) == mask
    window.close()
    window = opened(qtbot, start_again, tmp_path)
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
    (tmp_path / "a.tfscope.mask.nrrd").unlink()
    # Figures have none, and say so if they showed one.
    for name in ("masked.png", "whole.png"):
        figure = tmp_path / name
        saved_figure(qtbot, window, FigureChoice(90, 40), figure)
        window.notice.clear()
        act_until(qtbot, window.workspace.volumeStarted, window.files.open, figure)
        assert shown(window) is None
        told = "mask is not in the figure, so all voxels are shown" in window.notice.text
        assert told == (name == "masked.png")
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, session)
    assert shown(window) is None
    assert "All voxels are shown" in window.notice.text and "no such file" in window.notice.text


def test_masks_are_saved_and_opened(qtbot, window, builders, tmp_path, monkeypatch):
    click(qtbot, window, 0.42).text.linkActivated.emit("a0")
    mask, path = window.state.inputs.mask, str(tmp_path / "mask.nrrd")
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (path, ""))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (path, ""))
    window.files.save_mask()
    # The edge, where the piece's surface fades, is not in the file, whose voxels are measured.
    size = volume_text(np.count_nonzero(mask.exact.shown), blocks())
    qtbot.waitUntil(lambda: window.status.news == f"Saved {path}: {size}.")
    assert mask.edge
    window.state.show_all_voxels()
    window.files.ask("Open mask", VOLUME_FILTER, window.files.open_mask)
    # It is found again, so that the picture is the same.
    qtbot.waitUntil(lambda: window.state.inputs.mask == mask)
    assert window.state.edits.stack.undoText() == "open mask"
    # What is cut away stays at the next time step, and not at another volume.
    for name, step in (("blocks2", 2), ("other", 3)):
        builders.volumes[name] = replace(blocks(), voxels=blocks().voxels // step, name=name)
    open_volume(qtbot, window, "blocks2")
    assert window.state.inputs.mask == mask
    open_volume(qtbot, window, "other")
    assert window.state.inputs.mask is None
    whole = SimpleITK.GetImageFromArray(np.ones((12, 12, 12), np.uint8))
    SimpleITK.WriteImage(whole, str(tmp_path / "ones.nrrd"))
    window.files.open_mask(tmp_path / "ones.nrrd")
    qtbot.waitUntil(lambda: window.status.news == "ones shows all voxels, so it hides nothing.")


def test_labels_of_a_file_are_chosen(qtbot, window, builders, tmp_path):
    labels = np.zeros((12, 12, 12), np.uint8)
    labels[..., 2:5], labels[..., 5:8], labels[..., 8:] = 1, 2, 3
    first = asked(qtbot, window, tmp_path / "labels.nrrd", labels)
    assert [first.list.item(row).text() for row in range(3)] == ["Left (1)", "2", "3"]
    assert first.list.item(0).icon().pixmap(9).toImage().pixelColor(4, 4).name() == "#ff0000"
    assert first.chosen == [1, 2, 3]
    # Thousands are checked as one change.
    changes = []
    first.list.itemChanged.connect(changes.append)
    QTest.mouseClick(next(b for b in first.findChildren(QPushButton) if b.text() == "&None"), LEFT)
    assert not first.show_button.isEnabled() and len(changes) < 2
    for row in (0, 2):
        first.list.setCurrentRow(row)
        QTest.keyClick(first.list, Qt.Key.Key_Space)
    QTest.mouseClick(first.show_button, LEFT)
    qtbot.waitUntil(lambda: window.state.inputs.mask is not None)
    np.testing.assert_array_equal(shown(window), (labels == 1) | (labels == 3))
    assert window.state.edits.stack.undoText() == "open labels"
    assert window.status.news == "Only voxels in 2 of 3 labels of labels are shown."
    # What is shown is checked the next time, and Escape changes nothing.
    again = asked(qtbot, window, tmp_path / "labels.nrrd", labels)
    assert again.chosen == [1, 3]
    QTest.keyClick(again, Qt.Key.Key_Escape)
    # What is of another grid is said, and nothing is lost.
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(labels[..., :6]), str(tmp_path / "half.nrrd"))
    window.files.open_mask(tmp_path / "half.nrrd")
    qtbot.waitUntil(lambda: "half has 6 x 12 x 12 voxels" in window.notice.text)
    np.testing.assert_array_equal(shown(window), (labels == 1) | (labels == 3))
    # The question ends with its volume.
    asked(qtbot, window, tmp_path / "labels.nrrd", labels)
    builders.volumes["other"] = blocks((12, 12, 13))
    open_volume(qtbot, window, "other")
    assert not any(d.isVisible() for d in window.findChildren(LabelsDialog))


def asked(qtbot, window, path, labels):
    """The dialog on a file with labels, one of which has a name and a colour."""
    image = SimpleITK.GetImageFromArray(labels)
    for key, value in (("LabelValue", "1"), ("Name", "Left"), ("Color", "1 0 0")):
        image.SetMetaData(f"Segment0_{key}", value)
    SimpleITK.WriteImage(image, str(path))
    window.files.open_mask(path)
    qtbot.waitUntil(lambda: any(d.isVisible() for d in window.findChildren(LabelsDialog)))
    return next(d for d in window.findChildren(LabelsDialog) if d.isVisible())


def test_two_windows_keep_a_mask_each(qtbot, window, start_again, tmp_path):
    other = opened(qtbot, start_again, tmp_path)
    click(qtbot, window, 0.42).text.linkActivated.emit("a0")
    click(qtbot, other, 0.42).text.linkActivated.emit("c0")
    masks = [each.state.inputs.mask for each in (window, other)]
    for each in (window, other):
        each.close()
    found = [read_mask(path, blocks()) for path in tmp_path.glob("kept/volumes/*.mask.nrrd")]
    assert len(found) == 2 and all(mask in found for mask in masks)
    # The last one wins.
    assert opened(qtbot, start_again, tmp_path).state.inputs.mask == masks[1]
