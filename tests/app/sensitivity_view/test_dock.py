import numpy as np
from mouse_events import at, box_of, drag
from PySide6.QtCore import QEvent, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QTableWidget

from model.scene.region import Outline


def resize(qtbot, window, width, height):
    window.resize(width, height)
    qtbot.waitUntil(lambda: (window.width(), window.height()) == (width, height))
    QApplication.processEvents()


def draw_region(canvas):
    QTest.keyClick(canvas.window(), Qt.Key.Key_R)
    drag(canvas, at(canvas, 0.25, 0.25), at(canvas, 0.5, 0.5))


def test_a_region_opens_the_panel_and_escape_closes_both(qtbot, window):
    resize(qtbot, window, 1280, 800)
    state, findings = window.sensitivity_state, window.sensitivity.findings
    area = window.editor.area
    assert findings.isHidden()
    before, images = area.rect, box_of(window.reference, window)
    canvas = window.reference.canvas
    draw_region(canvas)
    QApplication.processEvents()
    assert state.active is not None and findings.isVisible()
    assert findings.width() == 296
    assert area.rect.left() == before.left() and area.rect.width() < before.width()
    assert (window.width(), window.height()) == (1280, 800)
    assert box_of(window.reference, window) == images
    # Nothing moves under the mouse: the plot widens when it leaves, the header's parts stay.
    narrow, chip = area.rect.width(), window.sensitivity.chips.panel
    place = box_of(chip, window)
    area.widget.setAttribute(Qt.WidgetAttribute.WA_UnderMouse)
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    qtbot.waitUntil(lambda: box_of(chip, window) == place)
    assert state.active is None and findings.isHidden() and area.rect.width() == narrow
    area.widget.setAttribute(Qt.WidgetAttribute.WA_UnderMouse, False)
    QApplication.sendEvent(area.widget, QEvent(QEvent.Type.Leave))
    qtbot.waitUntil(lambda: area.rect == before)
    assert box_of(chip, window) == place
    # Opened by a key, it lies over the plot until then.
    area.widget.setAttribute(Qt.WidgetAttribute.WA_UnderMouse)
    QTest.keyClick(window, Qt.Key.Key_F8)
    QApplication.processEvents()
    box = findings.geometry()
    assert area.rect == before and findings.isVisible() and box.width() == 296
    QApplication.sendEvent(area.widget, QEvent(QEvent.Type.Leave))
    qtbot.waitUntil(lambda: area.rect.width() == narrow)
    assert findings.geometry() == box
    area.widget.setAttribute(Qt.WidgetAttribute.WA_UnderMouse, False)
    QTest.keyClick(window, Qt.Key.Key_F8)
    # In a window of another size, and with another volume, it has room of its own at once.
    area.widget.setAttribute(Qt.WidgetAttribute.WA_UnderMouse)
    QTest.keyClick(window, Qt.Key.Key_F8)
    resize(qtbot, window, 1290, 800)
    assert findings.geometry().right() == 1289 and area.rect.width() == narrow + 10
    area.widget.setAttribute(Qt.WidgetAttribute.WA_UnderMouse, False)
    resize(qtbot, window, 1280, 800)
    area.widget.setAttribute(Qt.WidgetAttribute.WA_UnderMouse)
    findings.close_button.click()
    assert area.rect.width() == narrow
    window.workspace.volumeStarted.emit()
    assert area.rect == before
    area.widget.setAttribute(Qt.WidgetAttribute.WA_UnderMouse, False)
    # The button, the key and the panel's own one do it, too.
    window.sensitivity.chips.panel.click()
    assert findings.isVisible()
    findings.close_button.click()
    assert findings.isHidden() and not window.sensitivity.chips.panel.isChecked()
    QTest.keyClick(window, Qt.Key.Key_F8)
    assert findings.isVisible()
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    assert findings.isHidden()
    # In a wide window, where it is open by itself, it stays.
    resize(qtbot, window, 1700, 800)
    state.choose(panel=None)
    draw_region(canvas)
    QTest.keyClick(canvas, Qt.Key.Key_Escape)
    assert state.active is None and findings.isVisible()
    # Regions of a volume that is opened again open no panel.
    state.add_region(Outline.rectangle(0.2, 0.2, 0.4, 0.4))
    window.sensitivity_state.open_panel(False)
    state.start_volume(False, state.regions, 0, 1)
    assert state.active == 0 and window.sensitivity.findings.isHidden()


def test_the_curves_unit_zero_and_sign_are_read_from_the_plot(qtbot, window):
    area = window.editor.area
    # Without a region, the curve is there on purpose only.
    assert area.second_labels.labels == ()
    window.sensitivity.chips.change.click()
    labels = {text: place for place, text in area.second_labels.labels}
    (unit,) = (text for text in labels if text == "change")
    numbers = {text: place for text, place in labels.items() if text != unit}
    assert len(numbers) == 3 and "0" in numbers
    # The same numbers are there as a table.
    dialog = window.sensitivity.show_table()
    table = dialog.findChild(QTableWidget)
    assert table.rowCount() == 256 and table.columnCount() == 3
    heads = [table.horizontalHeaderItem(i).text() for i in range(3)]
    assert heads == [
        "Value",
        *(f"Change if opacity rises by .01, {name}" for name in ("exact", "learned")),
    ]
    exact = window.sensitivity.responses.curves["exact"].heights
    written = [table.item(row, 1).text().replace("−", "-") for row in range(256)]
    np.testing.assert_allclose([float(text) for text in written], exact, rtol=0.01, atol=1e-4)
    dialog.reject()
    window.sensitivity.chips.change.click()
    assert area.second_labels.labels == ()


def test_the_curve_comes_with_a_region_and_goes_with_it(qtbot, window):
    state, responses = window.sensitivity_state, window.sensitivity.responses

    def is_there():
        flags = any(not flag.isHidden() for flag in responses.flags)
        numbers = bool(window.editor.area.second_labels.labels)
        has_curve = responses.curves["exact"].isVisible()
        chip = window.sensitivity.chips.change.isChecked()
        return flags and numbers and has_curve and chip

    def is_away():
        numbers = bool(window.editor.area.second_labels.labels)
        return all(flag.isHidden() for flag in responses.flags) and not numbers

    assert is_away()
    state.add_region(Outline.rectangle(0.2, 0.2, 0.4, 0.4))
    state.finish("regions")
    qtbot.waitUntil(is_there)
    state.activate(None)
    assert is_away()
    # On purpose, it is there without a region, too; each of the two is remembered.
    window.sensitivity.chips.change.click()
    qtbot.waitUntil(is_there)
    state.activate(0)
    window.sensitivity.chips.change.click()
    assert is_away()
    state.activate(None)
    qtbot.waitUntil(is_there)
    # Choosing a layer shows sensitivities again, and no other layer.
    state.choose(shown=False, visible=False)
    state.show_layer("curve", True)
    assert state.choices.shown and not state.choices.visible
