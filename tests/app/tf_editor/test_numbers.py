from __future__ import annotations

from dataclasses import replace

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.state.viewer_state import ViewerState
from app.tf_editor.moves import HandleMoves
from app.tf_editor.number_box import NumberBox
from app.tf_editor.numbers import NumbersPanel
from app.tf_editor.selection import Selection


@pytest.fixture
def selection() -> Selection:
    return Selection()


@pytest.fixture
def panel(qtbot: QtBot, state: ViewerState, selection: Selection) -> NumbersPanel:
    panel = NumbersPanel(state, selection, HandleMoves(state, selection))
    qtbot.addWidget(panel)
    panel.show()
    return panel


def type_number(box: NumberBox, text: str) -> None:
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def test_the_numbers_follow_a_drag(
    panel: NumbersPanel, state: ViewerState, selection: Selection
) -> None:
    selection.select("opacity", 0)
    tf = state.transfer_function
    mode = replace(tf.opacity.modes[0], mean=123.25, width=4.5, amplitude=0.75)
    modes = (mode, tf.opacity.modes[1])
    state.preview(replace(tf, opacity=replace(tf.opacity, modes=modes)))
    assert panel.value.text() == "123.25"
    assert panel.width_box.text() == "4.5"
    assert panel.height_box.text() == "0.75"
    state.finish_preview("drag")


def test_typed_numbers_reach_the_session_and_can_be_undone(
    panel: NumbersPanel, state: ViewerState, selection: Selection
) -> None:
    selection.select("opacity", 1)
    type_number(panel.value, "155.5")
    type_number(panel.width_box, "12")
    type_number(panel.height_box, "0.125")
    mode = state.transfer_function.opacity.modes[1]
    assert (mode.mean, mode.width, mode.amplitude) == (155.5, 12.0, 0.125)
    for _ in range(3):
        state.undo()
    mode = state.transfer_function.opacity.modes[1]
    assert (mode.mean, mode.width, mode.amplitude) == (170.0, 8.0, 0.5)
    assert panel.value.text() == "170"


def test_a_number_outside_the_range_stays_until_it_is_mended(
    panel: NumbersPanel, state: ViewerState, selection: Selection
) -> None:
    selection.select("opacity", 0)
    type_number(panel.value, "1e6")
    assert state.transfer_function.opacity.modes[0].mean == 130.0
    assert panel.value.text() == "1e6"
    assert panel.value.entry.reason == "1e6 is above the limits: from 100 to 200."
    # Another number is taken meanwhile.
    type_number(panel.height_box, "0.25")
    assert state.transfer_function.opacity.modes[0].amplitude == 0.25
    assert panel.value.text() == "1e6"
    # It was meant for this mode alone.
    selection.select("opacity", 1)
    assert panel.value.text() == "170" and not panel.value.entry.reason


def test_a_stop_between_two_others_can_be_typed_only_up_to_them(
    panel: NumbersPanel, state: ViewerState, selection: Selection
) -> None:
    selection.select("color", 1)
    type_number(panel.value, "125")
    assert state.transfer_function.color.stops[1][0] == 125.0
    assert panel.heading.text() == "Colour stop 2 of 3"
    assert not panel.width_box.isVisible()
    assert panel.color_button.isVisible()
    selection.select("color", 0)
    assert not panel.value.isEnabled()
    assert not panel.remove_button.isEnabled()


def test_buttons_ask_for_what_they_say(
    qtbot: QtBot, panel: NumbersPanel, selection: Selection
) -> None:
    assert not panel.remove_button.isEnabled()
    selection.select("opacity", 0)
    with qtbot.waitSignals([panel.addRequested, panel.removeRequested], order="strict"):
        panel.add_button.click()
        panel.remove_button.click()
