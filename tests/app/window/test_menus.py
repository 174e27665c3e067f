from pathlib import Path

from fake_models import make_model
from mouse_events import wheel
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QAccessible, QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QCheckBox,
    QComboBox,
    QLineEdit,
    QPushButton,
    QScrollBar,
    QTabBar,
    QWidget,
)
from ramp import make_volume
from rested_window import notice_buttons
from superqt import QDoubleRangeSlider

from app.image_view.image_canvas import ImageCanvas
from app.state import library
from app.window.context import menu_names
from app.window.settings_dialog import SettingsDialog
from model.scene.region import Outline


def menu_of(window, *titles):
    menu = window.top_bar.menu_bar
    for title in titles:
        found = [a.menu() for a in menu.actions() if a.text().replace("&", "") == title]
        menu = found[0]
    return menu


def visible(menu):
    menu.aboutToShow.emit()
    return [a.text().replace("&", "") for a in menu.actions() if a.isVisible() and a.text()]


def test_a_shipped_network_opens_with_its_volume(
    qtbot, make_window, builders, tmp_path, monkeypatch
):
    model = make_model(tmp_path / "model")
    monkeypatch.setattr(library, "shipped_models", lambda: [model])
    monkeypatch.setattr(library, "shipped_volumes", lambda: [tmp_path / "ramp.nrrd"])
    monkeypatch.setattr(library, "title_of", lambda path: path.stem.title())
    builders.volumes["other"] = make_volume("other", 300.0)
    window = make_window("other", model=None)
    opened = []
    window.workspace.volumeOpened.connect(lambda volume: opened.append(volume.path))
    menu = menu_of(window, "File", "Models")
    assert visible(menu) == ["Ramp, no light", "Open model…"]
    assert menu.actions()[0].toolTip() == "RMSE 0.050."
    menu.actions()[0].trigger()
    qtbot.waitUntil(lambda: window.workspace.model.folder == model)
    qtbot.waitUntil(lambda: bool(builders.generators))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert [path.name for path in opened] == ["ramp.nrrd"]
    assert "ramp was opened" in window.notice.text and "Go back" in notice_buttons(window)
    assert visible(menu) == ["Ramp, no light", "Open model…", "Close the model", "Recent models"]
    assert menu.actions()[0].isChecked()


def test_no_entry_stands_in_two_places_and_none_is_there_that_cannot_be_used(
    make_window, monkeypatch
):
    monkeypatch.setattr(library, "shipped_models", list)
    window = make_window(model=None)
    bar = window.top_bar
    buttons = [b.accessibleName() for b in (bar.compare, bar.difference, bar.browse, bar.save)]
    found = [*buttons, bar.light.accessibleName()]
    menus = [menu_of(window, title) for title in ("File", "Edit", "View", "Region", "Help")]
    while menus:
        menu = menus.pop()
        found += visible(menu)
        keys = [a.text().partition("&")[2][:1].lower() for a in menu.actions() if "&" in a.text()]
        assert len(keys) == len(set(keys)), (menu.title(), keys)
        menus += [each for a in menu.actions() if a.isVisible() and (each := a.menu())]
    assert len(found) == len(set(found)) and "Crop box" in found, sorted(found)
    for missed in ("Recent sessions", "Draw missing voxels", "Swap sides", "Close the model"):
        assert missed not in found


def test_settings_are_found_by_words_and_apply_at_once(qtbot, make_window):
    window = make_window()
    (action,) = [a for a in window.findChildren(QAction) if a.text() == "&Settings…"]
    action.trigger()
    (dialog,) = window.findChildren(SettingsDialog)

    def found():
        return [row.accessibleName() for row, _, _ in dialog._rows if not row.isHidden()]

    everything = found()
    lefts = {row.x() for row, _, _ in dialog._rows}
    assert {"Renderer", "Image size", "Theme", "Single-key shortcuts"} < set(everything)
    for words, expected in (("ray caster", ["Renderer"]), ("512", ["Image size"]), ("xyz", [])):
        dialog.search.setText(words)
        assert found() == expected
        dialog.layout().activate()
        assert {row.x() for row, _, _ in dialog._rows if row.isVisible()} <= lefts
    dialog.search.setText("")
    assert found() == everything
    boxes = {b.accessibleName(): b for b in dialog.findChildren(QComboBox)}
    row = boxes["Image size"].findText("512 × 512")
    boxes["Image size"].setCurrentIndex(row)
    boxes["Image size"].activated.emit(row)
    assert window.workspace.reference.choices.reference_size == 512
    switches = {b.accessibleName(): b for b in dialog.findChildren(QCheckBox)}
    switches["Orientation cube"].click()
    assert not window.overlays.has("cube")
    switches["Single-key shortcuts"].click()
    assert not window.preferences.settings.single_keys
    window.preferences.note_recent("sessions", Path("a.tfscope"))
    QTest.keyClick(dialog.search, Qt.Key.Key_Return)
    assert window.preferences.recent("sessions") and dialog.isVisible()
    (forget,) = [b for b in dialog.findChildren(QPushButton) if b.text() == "Forget them"]
    forget.click()
    assert window.preferences.recent("sessions") == []
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    QTest.keyClick(switches["Orientation cube"], Qt.Key.Key_Return)
    assert dialog.isHidden()


def test_files_of_one_name_are_told_apart_by_their_folders():
    paths = [Path("/a/engine.nrrd"), Path("/b/engine.nrrd"), Path("/a/fly & co.nrrd")]
    assert menu_names(paths) == ["engine.nrrd  (a)", "engine.nrrd  (b)", "fly && co.nrrd"]
    paths = [Path("/s1/anat/t1.nii"), Path("/s2/anat/t1.nii")]
    assert menu_names(paths) == ["t1.nii  (s1/anat)", "t1.nii  (s2/anat)"]
    assert menu_names([]) == []


CONTROLS = QAbstractButton, QAbstractSpinBox, QAbstractSlider, QComboBox, QLineEdit, ImageCanvas

MOST = 200  # keys after which Tab goes round in a circle without the first one


def values(parent):
    """What everything shows that might take the wheel, in menus and popups, too."""
    found = {w: w.text() for w in parent.findChildren(QAbstractSpinBox)}
    for kind in (QComboBox, QTabBar):
        found |= {w: w.currentIndex() for w in parent.findChildren(kind)}
    sliders = parent.findChildren(QAbstractSlider)
    return found | {w: w.value() for w in sliders if not isinstance(w, QScrollBar)}


def walked(qtbot, window, key=Qt.Key.Key_Tab):
    """What has the focus, one after the other, until the first one has it again."""
    first = window.top_bar.volume
    first.setFocus()
    qtbot.waitUntil(first.hasFocus)
    found = [first]
    for _ in range(MOST):
        QTest.keyClick(found[-1], key)
        following = QApplication.focusWidget()
        if following is first:
            return found
        if following is found[-1]:
            # From one of its ends, or handles, to the next.
            continue
        assert following not in found, (name_of(following), [name_of(each) for each in found])
        found.append(following)
    raise AssertionError([name_of(each) for each in found])


def controls(window):
    for widget in window.findChildren(QWidget):
        inner = isinstance(widget.parentWidget(), (QAbstractSpinBox, QLineEdit, QComboBox))
        is_seen = widget.isVisible() and not widget.visibleRegion().isEmpty()
        is_shown = is_seen and widget.isEnabled()
        # By keys, the planes of the crop box are moved in the number boxes.
        is_for_mice = isinstance(widget, QDoubleRangeSlider)
        if isinstance(widget, CONTROLS) and is_shown and not (inner or is_for_mice):
            yield widget


def name_of(widget):
    """What a screen reader says."""
    interface = QAccessible.queryAccessibleInterface(widget)
    return interface.text(QAccessible.Text.Name) if interface else ""


def test_tab_reaches_every_control_and_each_has_a_name(qtbot, make_window):
    # With a region, all cards, a notice and the panel.
    window = make_window()
    window.resize(1600, 1000)
    window.sensitivity_state.add_region(Outline.rectangle(0.3, 0.3, 0.7, 0.6))
    window.crop_card.set_shown(True)
    window.up_axis_card.ask()
    window.notice.add("It failed.", tone="error")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    window.editor.selection.select("opacity", 0)
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    for browsing in (False, True):
        window.latent_state.choose(shown=browsing)
        reached = walked(qtbot, window)
        missed = [name_of(widget) for widget in controls(window) if widget not in reached]
        assert missed == []
        assert len(reached) > 40
        assert [type(widget).__name__ for widget in reached if not name_of(widget)] == []
        back = walked(qtbot, window, Qt.Key.Key_Backtab)
        assert back[1:] == reached[:0:-1]
    # And none follows the wheel unasked.
    window.latent_state.choose(shown=True)
    before = values(window)
    assert len(before) >= 15
    for control in before:
        control.clearFocus()
        for notches in (1, -1, -1):
            wheel(control, QPointF(control.rect().center()), notches)
        assert not control.hasFocus(), name_of(control)
        assert control.focusPolicy() != Qt.FocusPolicy.WheelFocus, name_of(control)
    assert values(window) == before
