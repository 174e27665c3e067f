"""From the drop of a file to the pixels."""

import threading
from pathlib import Path

import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from ramp import make_tf, make_volume
from rested_window import act_until, notice_buttons, rested

from app.state.library import Library
from model.scene.crop import CropBox
from model.scene.ranges import fit_to_range
from model.scene.scene import Scene
from model.scene.view import View


def drop(window, name):
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(f"/somewhere/{name}.nrrd")])
    none, left = Qt.KeyboardModifier.NoModifier, Qt.MouseButton.LeftButton
    copy = Qt.DropAction.CopyAction
    QApplication.sendEvent(window, QDragEnterEvent(QPoint(9, 9), copy, data, left, none))
    QApplication.sendEvent(window, QDropEvent(QPointF(9, 9), copy, data, left, none))


def seen_over(window):
    """The volume's name and the TF's range of each picture that the pane shows from now on."""
    seen = []

    def note(result):
        name = window.windowTitle().partition(" ")[0]
        seen.append((name, result.request.inputs.opacity_tf.scalar_range))

    window.reference.resultShown.connect(note)
    return seen


@pytest.fixture
def window(qtbot, builders, make_window):
    """A window with a volume; two others can be dropped on it."""
    for name, top in (("tall", 300.0), ("flat", 150.0)):
        builders.volumes[name] = make_volume(name, top)
    return rested(qtbot, make_window)


def opened(qtbot, window, name):
    """Wait until a volume's pictures are there."""
    work = window.workspace
    qtbot.waitUntil(lambda: work.opened is not None and work.opened.volume.name == name)
    qtbot.waitUntil(lambda: work.is_settled and window.reference.canvas.image is not None)


def test_a_dropped_volume_is_drawn_once_and_as_its_own(qtbot, window, builders):
    seen, engines = seen_over(window), len(builders.references)
    drop(window, "tall")
    assert "Reading tall.nrrd" in window.status.news
    opened(qtbot, window, "tall")
    # No picture mixes two volumes, and one engine draws them all.
    assert seen and set(seen) == {("tall", (100.0, 300.0))}
    assert len(builders.references) == engines + 1
    assert window.state.transfer_function == window.workspace.opened.default
    assert window.editor.area.histogram.counts.sum() == builders.volumes["tall"].voxels.size
    assert not window.state.edits.stack.canUndo()
    assert window.preferences.recent("volumes")[0].name == "tall.nrrd"


def test_what_is_remembered_is_there_with_the_first_picture(qtbot, window, builders):
    window.status._rest.setInterval(1_000_000)
    drop(window, "tall")
    opened(qtbot, window, "tall")
    view, crop = View(azimuth=77.0), CropBox((0.1, 0.0, 0.0), (0.9, 1.0, 1.0))
    window.state.set_view(view)
    window.state.crop_input.set(crop)
    narrow = fit_to_range(make_tf(150.0), (120.0, 180.0))
    act_until(qtbot, window.workspace.rangeChanged, window.state.tf_input.set, narrow, "edit")
    drop(window, "flat")
    opened(qtbot, window, "flat")
    assert window.state.crop is None
    seen, drawn = seen_over(window), len(builders.drawn)
    drop(window, "tall")
    opened(qtbot, window, "tall")
    # At once: no engine was built for the range of a new volume.
    assert [volume.scalar_range for volume in builders.drawn[drawn:]] == [(120.0, 180.0)]
    assert set(seen) == {("tall", (120.0, 180.0))}
    assert window.state.transfer_function == narrow
    assert (window.state.view, window.state.crop) == (view, crop)
    assert "restored" in window.status.news


def test_a_file_that_cannot_be_read_leaves_all_as_it_was(qtbot, window):
    before, title = window.state.inputs, window.windowTitle()
    drop(window, "gone")
    qtbot.waitUntil(lambda: "the file is missing" in window.notice.text)
    assert window.workspace.is_settled
    assert (window.state.inputs, window.windowTitle()) == (before, title)
    # The next one takes the error away.
    drop(window, "tall")
    opened(qtbot, window, "tall")
    assert window.notice.text == ""


def test_a_file_that_is_dropped_while_another_is_read_replaces_it(qtbot, window, builders):
    builders.held["tall"] = threading.Event()
    seen = seen_over(window)
    drop(window, "tall")
    qtbot.waitUntil(lambda: "0 of 2 slices read" in window.status.news)
    drop(window, "flat")
    opened(qtbot, window, "flat")
    builders.held["tall"].set()
    qtbot.waitUntil(lambda: builders.ended == ["tall"])
    # Its thread's last message is delivered before this one's.
    QTest.qWait(0)
    assert set(seen) == {("flat", (100.0, 150.0))}
    assert window.workspace.is_settled and window.windowTitle().startswith("flat")


def test_a_model_that_is_opened_while_its_volume_is_read_gives_its_range(
    qtbot, window, builders, monkeypatch
):
    scene = builders.scene = Scene.of(builders.volumes["tall"].over((150.0, 250.0)), image_size=16)
    monkeypatch.setattr(Library, "scene_of", lambda _self, _folder: scene)
    builders.held["tall"] = threading.Event()
    seen = seen_over(window)
    drop(window, "tall")
    window.workspace.open_model(Path("late"))
    builders.held["tall"].set()
    opened(qtbot, window, "tall")
    # The model's pane made the image of the volume before narrower.
    assert {each for each in seen if each[0] == "tall"} == {("tall", (150.0, 250.0))}
    # That the model has another range is no edit.
    assert window.state.edits.stack.undoText() == ""


def test_a_reading_that_is_cancelled_leaves_all_as_it_was(qtbot, window, builders):
    builders.held["tall"] = threading.Event()
    before, title = window.state.inputs, window.windowTitle()
    window.files._slow.setInterval(1)
    drop(window, "tall")
    qtbot.waitUntil(lambda: "Reading tall.nrrd" in window.notice.text)
    notice_buttons(window)["Cancel"].click()
    assert "the reading was cancelled" in window.notice.text and window.workspace.is_settled
    builders.held["tall"].set()
    qtbot.waitUntil(lambda: builders.ended == ["tall"])
    QTest.qWait(0)
    assert (window.state.inputs, window.windowTitle()) == (before, title)
    drop(window, "flat")
    opened(qtbot, window, "flat")
