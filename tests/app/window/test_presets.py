from pathlib import Path

import pytest
from PySide6.QtWidgets import QInputDialog, QMessageBox
from ramp import make_tf

from app.tf_editor.tf_menu import PICTURE
from app.window.presets import save_own_preset
from model.scene.ranges import stretch_to_range


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

    def level(number):
        image = entries.item(number).icon().pixmap(PICTURE, PICTURE).toImage()
        return image.pixelColor(PICTURE // 2, PICTURE // 2).red()

    # The fake's pictures are each .1 brighter than the one before.
    qtbot.waitUntil(lambda: level(3) > 0)
    assert [level(n) for n in (0, 1, 3)] == pytest.approx([0, 26, 76], abs=1)
    menu.take(entries.item(2))
    assert state.transfer_function.opacity == request.more[1].opacity_tf
    assert state.edits.stack.undoText() == f"preset {entries.item(2).text()}"
    # All of them leave the range as it is.
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.editor.range.set_range((120.0, 160.0))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    menu.aboutToShow.emit()
    # Another analyst, of the new range.
    qtbot.waitUntil(lambda: bool(asked()))
    for inputs in (asked()[-1].inputs, *asked()[-1].more):
        assert inputs.opacity_tf.scalar_range == (120.0, 160.0)
    for number in range(entries.count()):
        menu.take(entries.item(number))
        assert state.scalar_range == (120.0, 160.0)


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
    assert window.status.news == "Saved the preset Skull_ thin."
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
        patch.setattr(Path, "unlink", refuse)
        removal.actions()[0].trigger()
    assert "Skull_ thin.json: the preset cannot be removed (busy)" in window.notice.text
    removal.actions()[0].trigger()
    assert names() == shipped


def refuse(*_, **__):
    raise OSError(16, "busy")


def test_a_preset_of_another_scale_keeps_its_shape(make_window, tmp_path):
    window = make_window(model=None, folder=tmp_path)
    menu = window.editor.menu.presets
    linear = stretch_to_range(make_tf(150.0), (0.0, 4000.0))
    save_own_preset(tmp_path, "Default", linear.on_scale("log"))
    menu.aboutToShow.emit()
    own = menu.listed()[-1].tf
    assert own.scale == "linear"
    assert own.opacity == make_tf(150.0).opacity
