from dataclasses import replace
from itertools import product

import pytest
from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QColorDialog, QToolButton

from model.scene.transfer_function import GaussianMode, OpacityTF

SIZES = [(1440, 315), (1000, 224), (724, 224)]
"""Of the editor in windows of 1440 x 900 and 1000 x 640, and in the latter with the panel."""


@pytest.fixture
def make_editor(qtbot, state, open_editor):
    def make(width=1440, height=315, mean=170.0, amplitude=0.9):
        editor = open_editor(width=width, height=height)
        editor.activateWindow()
        qtbot.waitUntil(editor.isActiveWindow)
        mode = GaussianMode(mean, 8.0, amplitude)
        tf = replace(state.transfer_function, opacity=OpacityTF((100.0, 200.0), modes=(mode,)))
        state.start_volume(tf, None)
        editor.selection.select("opacity", 0)
        QApplication.processEvents()
        return editor

    return make


@pytest.mark.parametrize("size", SIZES)
def test_the_card_is_at_its_handle_in_the_plot_and_over_no_flag(make_editor, state, size):
    editor = make_editor(*size)
    card, box = editor.card, editor.area.opacity.sceneBoundingRect()
    plot = QRect(*map(editor.area.widget.mapFromScene, (box.topLeft(), box.bottomRight())))
    flags = [QToolButton() for _ in range(2)]
    for flag in flags:
        editor.area.add_flag(flag)
    for mean, amplitude in product((100.0, 104.0, 150.0, 199.0, 200.0), (0.0, 0.5, 1.0)):
        mode = GaussianMode(mean, 8.0, amplitude)
        opacity = OpacityTF((100.0, 200.0), modes=(mode,))
        state.tf_input.set(replace(state.transfer_function, opacity=opacity), "edit")
        handle = editor.area.widget.mapFromScene(editor.opacity.peaks[0].scenePos())
        for flag, x in zip(flags, (handle.x() - 60, handle.x() + 30), strict=True):
            left = min(max(x, plot.left()), plot.right() - 60)
            flag.setGeometry(left, plot.top(), 60, 19)
            flag.show()
        editor.area.flagsMoved.emit()
        box = card.geometry()
        assert card.isVisible() and plot.contains(box)
        assert not box.contains(handle)
        assert not any(box.intersects(flag.geometry()) for flag in flags)


def test_f2_types_numbers_tab_goes_on_and_escape_or_enter_returns(qtbot, make_editor, state):
    editor = make_editor()
    card = editor.card
    QTest.keyClick(editor, Qt.Key.Key_F2)
    qtbot.waitUntil(card.value.hasFocus)
    QTest.keyClicks(card.value, "150")
    QTest.keyClick(card.value, Qt.Key.Key_Tab)
    assert state.transfer_function.opacity.modes[0].mean == 150.0
    assert card.width_box.hasFocus()
    QTest.keyClicks(card.width_box, "12")
    QTest.keyClick(card.width_box, Qt.Key.Key_Tab)
    assert state.transfer_function.opacity.modes[0].width == 12.0
    assert card.height_box.hasFocus()
    # It is the same undo step for as long as the same number is typed, and no longer.
    state.edits.undo()
    assert state.transfer_function.opacity.modes[0].mean == 150.0
    QTest.keyClick(card.height_box, Qt.Key.Key_Escape)
    assert editor.area.widget.hasFocus()
    # The value of a curve's end is fixed.
    curve = OpacityTF((100.0, 200.0), points=((100.0, 0.1), (200.0, 0.9)))
    state.start_volume(replace(state.transfer_function, opacity=curve), None)
    editor.selection.select("opacity", 0)
    QTest.keyClick(editor, Qt.Key.Key_F2)
    QTest.keyClicks(QApplication.focusWidget(), ".3")
    QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Return)
    assert state.transfer_function.opacity.points[0] == (100.0, 0.3)
    assert editor.area.widget.hasFocus()


def test_the_colour_of_a_mode_is_chosen_at_its_card_in_one_step(make_editor, state):
    editor = make_editor(mean=130.0)
    before = state.transfer_function
    editor.card.color_button.click()
    (dialog,) = editor.area.widget.findChildren(QColorDialog)
    for color in ("#ff0000", "#336699"):
        dialog.setCurrentColor(QColor(color))
    dialog.accept()
    assert len(state.transfer_function.color.stops) == len(before.color.stops) + 1
    assert tuple(state.transfer_function.color(130.0)) == pytest.approx((0.2, 0.4, 0.6))
    state.edits.undo()
    assert state.transfer_function == before
