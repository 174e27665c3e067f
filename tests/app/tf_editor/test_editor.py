from dataclasses import replace

import numpy as np
import pytest
from editor_events import LEFT, click, double_click, drag
from mouse_events import pixel
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QMenu

from app.tf_editor.plot_area import PIN_PLACE
from model.scene.transfer_function import OpacityTF


def strip_pixel(editor, value, height=PIN_PLACE):
    at = editor.area.strip.mapViewToScene(QPointF(value / 100 - 1, height))
    return editor.area.widget.mapFromScene(at)


def position(handle):
    """Where a handle stands, in the data's units."""
    return round(100 + 100 * handle.pos().x(), 9), handle.pos().y()


def test_dragging_a_peak_edits_live_and_makes_one_undo_step(qtbot, editor, state):
    places = (130.0, 0.5), (140.0, 0.6), (150.0, 0.8)
    start, half, end = (pixel(editor, *place) for place in places)
    viewport = editor.area.widget.viewport()
    with qtbot.assertNotEmitted(state.tf_input.changeFinished):
        QTest.mousePress(viewport, LEFT, pos=start)
        QTest.mouseMove(viewport, half)
        QTest.mouseMove(viewport, end)
    assert state.live
    qtbot.waitUntil(lambda: editor.area.readout[6:9] in ("149", "150"))
    first, value, second, height = editor.area.readout.split()
    assert float(value) == pytest.approx(150.0, abs=0.3)
    assert (first, second) == ("value", "opacity")
    assert float(height) == pytest.approx(0.8, abs=0.02)
    assert editor.card.heading == "Mode 1 of 2" and editor.card.isHidden()
    with qtbot.waitSignal(state.tf_input.changeFinished):
        QTest.mouseRelease(viewport, LEFT, pos=end)
    mode = state.transfer_function.opacity.modes[0]
    assert mode.mean == pytest.approx(150.0, abs=0.3)
    assert mode.amplitude == pytest.approx(0.8, abs=0.02)
    assert mode.width == 8.0
    assert editor.area.readout == ""
    state.edits.undo()
    assert state.transfer_function.opacity.modes[0].mean == 130.0
    assert not state.edits.stack.canUndo()


def test_dragging_a_flank_changes_only_the_width(qtbot, editor, state):
    click(editor, pixel(editor, 170.0, 0.5))
    left, right = editor.opacity.flanks
    assert (position(left)[0], position(right)[0]) == (162.0, 178.0)
    viewport, height = editor.area.widget.viewport(), right.pos().y()
    end = pixel(editor, 185.0, height)
    QTest.mousePress(viewport, LEFT, pos=pixel(editor, 178.0, height))
    QTest.mouseMove(viewport, end)
    qtbot.waitUntil(lambda: "width" in editor.area.readout)
    QTest.mouseRelease(viewport, LEFT, pos=end)
    mode = state.transfer_function.opacity.modes[1]
    assert (mode.mean, mode.amplitude) == (170.0, 0.5)
    assert mode.width == pytest.approx(15.0, abs=0.3)


def test_a_double_click_adds_a_mode_and_delete_removes_it(qtbot, editor, state):
    before = state.transfer_function
    at = pixel(editor, 150.0, 0.75)
    double_click(editor, at)
    added = state.transfer_function.opacity.modes[2]
    assert added.mean == pytest.approx(150.0, abs=0.3)
    assert added.amplitude == pytest.approx(0.75, abs=0.02)
    assert editor.selection.index("opacity") == 2
    QTest.keyClick(editor.area.widget, Qt.Key.Key_Delete)
    assert state.transfer_function == before
    state.edits.undo()
    assert state.transfer_function.opacity.modes[2] == added


def test_a_click_on_the_strip_adds_a_stop_without_changing_colors(editor, state):
    before = state.transfer_function.color
    click(editor, strip_pixel(editor, 125.0, 0.5))
    color = state.transfer_function.color
    assert len(color.stops) == 4
    assert color.stops[1][0] == pytest.approx(125.0, abs=0.3)
    values = np.linspace(100.0, 200.0, 99)
    np.testing.assert_allclose(color(values), before(values), atol=1e-12)
    assert editor.selection.index("color") == 1
    QTest.keyClick(editor.area.widget, Qt.Key.Key_Delete)
    assert state.transfer_function.color == before


def test_a_stop_can_be_dragged_and_the_end_stops_cannot(editor, state):
    for start, end in ((150.0, 120.0), (200.0, 160.0)):
        drag(editor, strip_pixel(editor, start), strip_pixel(editor, end))
    values = [s[0] for s in state.transfer_function.color.stops]
    assert values == pytest.approx([100.0, 120.0, 200.0], abs=0.3)


def test_the_color_dialog_is_live_and_can_be_cancelled(qtbot, editor, state):
    dialog = editor.color.choose_color(1)
    dialog.setCurrentColor(QColor("#336699"))
    assert state.live
    assert state.transfer_function.color.stops[1][1:] == pytest.approx((0.2, 0.4, 0.6))
    dialog.reject()
    assert state.transfer_function.color.stops[1][1:] == (0.2, 0.6, 0.4)
    dialog = editor.color.choose_color(1)
    dialog.setCurrentColor(QColor("#336699"))
    dialog.accept()
    assert not state.live
    assert state.edits.stack.count() == 1
    assert state.transfer_function.color.stops[1][1:] == pytest.approx((0.2, 0.4, 0.6))
    # Another volume closes it.
    dialog = editor.color.choose_color(1)
    dialog.setCurrentColor(QColor("#ffffff"))
    other = replace(state.transfer_function, opacity=OpacityTF((100.0, 200.0)))
    state.start_volume(other, None)
    assert not dialog.isVisible() and not state.live
    assert state.transfer_function == other


def choose(editor, text):
    """Choose from the context menu that is open."""
    (menu,) = (m for m in editor.area.widget.findChildren(QMenu) if m.isVisible())
    (action,) = (a for a in menu.actions() if a.text() == text)
    action.trigger()
    menu.close()


def test_the_context_menus_remove_and_add(editor, state):
    editor.opacity.peaks[0].menu(QPoint())
    choose(editor, "Remove mode")
    assert [m.mean for m in state.transfer_function.opacity.modes] == [170.0]
    editor.color.stops[1].menu(QPoint())
    choose(editor, "Remove stop")
    assert len(state.transfer_function.color.stops) == 2
    right = Qt.MouseButton.RightButton
    QTest.mouseClick(editor.area.widget.viewport(), right, pos=pixel(editor, 120.0, 0.5))
    choose(editor, "Add mode here")
    assert state.transfer_function.opacity.modes[1].mean == pytest.approx(120.0, abs=0.3)


def test_a_free_curve_has_points_that_can_be_dragged(editor, state):
    curve = OpacityTF((100.0, 200.0), points=((100.0, 0.0), (150.0, 0.5), (200.0, 1.0)))
    state.tf_input.set(replace(state.transfer_function, opacity=curve), "edit")
    state.units = "K"
    assert tuple(position(h) for h in editor.opacity.peaks) == curve.points
    drag(editor, pixel(editor, 150.0, 0.5), pixel(editor, 170.0, 0.2))
    value, height = state.transfer_function.opacity.points[1]
    assert value == pytest.approx(170.0, abs=0.3) and height == pytest.approx(0.2, abs=0.02)
    assert not any(h.isVisible() for h in editor.opacity.flanks)
    assert editor.card.heading == "Point 2 of 3"
    assert "value (K)" in {each.text() for each in editor.card.findChildren(QLabel)}
    QTest.keyClick(editor.area.widget, Qt.Key.Key_Delete)
    assert len(state.transfer_function.opacity.points) == 2
