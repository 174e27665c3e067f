from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QInputDialog, QMessageBox
from ramp import make_tf
from rested_window import notice_buttons

from app.tf_editor.tf_menu import PICTURE
from model.scene import transfer_function
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.volume import Volume


def test_each_preset_shows_the_volume_and_can_be_taken(qtbot, window, builders):
    menu, state = window.editor.menu.presets, window.state
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    window.brightness.set(1.0)
    menu.aboutToShow.emit()

    def asked():
        return [r for r in builders.analysts[-1].others if r.channel == "presets"]

    qtbot.waitUntil(lambda: bool(asked()))
    request, entries = asked()[-1], menu.list
    assert entries.count() == 1 + len(request.more)
    # From the same side, with all that is shown in the middle of the square.
    assert request.inputs.view.basis() == pytest.approx(state.view.basis())
    assert request.inputs.view == state.for_picture(state.view)

    def level(number, mode=QIcon.Mode.Selected):
        image = entries.item(number).icon().pixmap(PICTURE, PICTURE, mode).toImage()
        return image.pixelColor(PICTURE // 2, PICTURE // 2).red()

    # The fake's pictures are each .1 brighter than the one before.
    qtbot.waitUntil(lambda: level(3) > 0)
    assert [level(n) for n in (0, 1, 3)] == pytest.approx([0, 26, 76], abs=1)
    assert level(3, QIcon.Mode.Normal) == level(3)
    # The same pictures are there at once when the menu opens again.
    menu.aboutToShow.emit()
    assert level(3) == pytest.approx(76, abs=1)
    window.overlays.choose_background("white")
    menu.aboutToShow.emit()
    # Those over black are not shown again.
    assert level(3) == 0
    qtbot.waitUntil(lambda: level(3) == 255)
    # An entry that the mouse crosses on its way to the pictures is marked only until then.
    menu.setActiveAction(menu.addAction("Crossed"))
    entries.itemEntered.emit(entries.item(0))
    assert menu.activeAction() is menu.actions()[0] and entries.hasMouseTracking()
    menu.take(entries.item(2))
    assert state.transfer_function.opacity == request.more[1].opacity_tf
    assert state.edits.stack.undoText() == f"preset {entries.item(2).text()}"
    # The present TF's is marked, if there is one.
    for tf, row in ((state.transfer_function, 2), (make_tf(150.0), -1)):
        state.tf_input.set(tf)
        menu.popup(QPoint())
        assert entries.currentRow() == row
        menu.hide()


def test_the_users_own_presets_are_kept_replaced_and_removed(make_window, tmp_path, monkeypatch):
    window = make_window(model=None, folder=tmp_path)
    menu, state = window.editor.menu.presets, window.state
    entries = {a.text(): a for a in menu.actions()}

    def names():
        menu.aboutToShow.emit()
        return [menu.list.item(row).text() for row in range(menu.list.count())]

    def save(name, mean):
        state.tf_input.set(make_tf(mean), "edit")
        monkeypatch.setattr(QInputDialog, "getText", lambda *_: (name, True))
        entries["Save as preset…"].trigger()

    shipped = names()
    assert not entries["Remove preset"].isVisible()
    save("Skull: thin", 125.0)
    save("", 130.0)
    monkeypatch.setattr(QMessageBox, "question", lambda *_: QMessageBox.StandardButton.No)
    save("Skull: thin", 140.0)
    assert names() == [*shipped, "Skull_ thin"]
    menu.take(menu.list.item(len(shipped)))
    assert state.transfer_function == make_tf(125.0)
    monkeypatch.setattr(QMessageBox, "question", lambda *_: QMessageBox.StandardButton.Yes)
    save("Skull: thin", 140.0)
    # A file that is damaged hides no other.
    (tmp_path / "presets" / "broken.json").write_text("{")
    assert names() == [*shipped, "Skull_ thin"]
    assert menu.listed()[-1].tf == make_tf(140.0)
    removal = entries["Remove preset"].menu()
    with monkeypatch.context() as patch:
        full = Mock(side_effect=OSError(28, "disk full"))
        patch.setattr(transfer_function, "write_atomically", full)
        save("Lung", 140.0)
        assert "(disk full); make room there, or use File > Save TF." in window.notice.text
        patch.setattr(Path, "unlink", Mock(side_effect=OSError(16, "busy")))
        removal.actions()[0].trigger()
    assert "Skull_ thin.json: the preset cannot be removed (busy)" in window.notice.text
    removal.actions()[0].trigger()
    assert names() == shipped
    # Names of shipped ones are theirs.
    save("Skin", 140.0)
    assert "Skin" in shipped and names() == [*shipped, "Skin 2"]


WIDE = (0.0, 65535.0)


def open_over(qtbot, window, change):
    """Change the TF, and wait until the volume is shown over its range."""
    change()
    work, state = window.workspace, window.state
    qtbot.waitUntil(lambda: work.opened.volume.scalar_range == state.scalar_range)


def test_what_is_too_narrow_for_the_range_is_said_with_a_range_for_it(
    qtbot, make_window, builders, tmp_path
):
    values = np.linspace(*WIDE, 6 * 5 * 4, dtype=np.float32).reshape(6, 5, 4)
    builders.volumes["wide"] = Volume(values, name="wide")
    window = make_window("wide", model=None)
    mode = OpacityTF(WIDE, (GaussianMode(30_000.0, 10.0, 0.8),))
    tf = TransferFunction(mode, ColorTF(WIDE, ((0.0, 0.1, 0.3, 0.9), (65_535.0, 1, 0, 0))))
    tf.save(tmp_path / "tf.json")
    open_over(qtbot, window, lambda: window.files.open_transfer_function(tmp_path / "tf.json"))
    assert "finer than 1/256 of the range 0 to 65,535" in window.notice.text
    (button,) = (b for text, b in notice_buttons(window).items() if text.startswith("Show "))
    open_over(qtbot, window, button.click)
    assert "finer" not in window.notice.text
    lo, hi = window.state.scalar_range
    assert 29_900 <= lo < 29_980 < 30_020 < hi <= 30_200
    # One step, which can be undone; then it is said again.
    open_over(qtbot, window, window.state.edits.undo)
    assert window.state.transfer_function == tf
    assert "finer" in window.notice.text
    window.notice.clear()
    # Once dismissed, it is not said again of the same part.
    recolored = TransferFunction(tf.opacity, ColorTF(WIDE, ((0.0, 1, 0, 0), (65_535.0, 0, 1, 0))))
    window.state.tf_input.set(recolored, "edit")
    assert window.notice.text == ""
    band = (29_977.0, 0.0), (30_000.0, 0.9), (30_023.0, 0.0)
    curve = OpacityTF(WIDE, points=((0.0, 0.0), *band, (65_535.0, 0.0)))
    window.state.tf_input.set(TransferFunction(curve, tf.color), "edit")
    assert "finer" in window.notice.text
