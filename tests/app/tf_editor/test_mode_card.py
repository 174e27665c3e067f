from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.number_box import NumberBox
from app.state.viewer_state import ViewerState
from app.tf_editor.mode_card import ModeCard
from app.tf_editor.moves import HandleMoves
from app.tf_editor.plot_area import PlotArea
from app.tf_editor.selection import Selection


@pytest.fixture
def selection() -> Selection:
    return Selection()


@pytest.fixture
def card(qtbot: QtBot, state: ViewerState, selection: Selection) -> ModeCard:
    area = PlotArea()
    qtbot.addWidget(area.widget)
    area.set_data(np.arange(256), np.linspace(100.0, 200.0, 257), (100.0, 200.0), "K")
    area.widget.resize(900, 280)
    area.widget.show()
    qtbot.waitExposed(area.widget)
    return ModeCard(area, state, selection, HandleMoves(state, selection))


def type_number(box: NumberBox, text: str) -> None:
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def test_the_numbers_follow_a_drag(
    card: ModeCard, state: ViewerState, selection: Selection
) -> None:
    selection.select("opacity", 0)
    tf = state.transfer_function
    mode = replace(tf.opacity.modes[0], mean=123.25, width=4.5, amplitude=0.75)
    modes = (mode, tf.opacity.modes[1])
    state.tf_input.move(replace(tf, opacity=replace(tf.opacity, modes=modes)))
    assert card.value.text() == "123.25"
    assert card.width_box.text() == "4.5"
    assert card.height_box.text() == "0.75"
    state.tf_input.finish("drag")


def test_typed_numbers_reach_the_session_and_can_be_undone(
    card: ModeCard, state: ViewerState, selection: Selection
) -> None:
    selection.select("opacity", 1)
    type_number(card.value, "155.5")
    type_number(card.width_box, "12")
    type_number(card.height_box, "0.125")
    mode = state.transfer_function.opacity.modes[1]
    assert (mode.mean, mode.width, mode.amplitude) == (155.5, 12.0, 0.125)
    for _ in range(3):
        state.edits.undo()
    mode = state.transfer_function.opacity.modes[1]
    assert (mode.mean, mode.width, mode.amplitude) == (170.0, 8.0, 0.5)
    assert card.value.text() == "170"


def test_a_stop_between_two_others_can_be_typed_only_up_to_them(
    card: ModeCard, state: ViewerState, selection: Selection
) -> None:
    selection.select("color", 1)
    type_number(card.value, "125")
    assert state.transfer_function.color.stops[1][0] == 125.0
    assert card.heading == "Colour stop 2 of 3"
    assert not card.width_box.isVisible()
    assert card.color_button.isVisible()
    selection.select("color", 0)
    assert not card.value.isEnabled()
    assert not card.remove_button.isEnabled()


def test_buttons_ask_for_what_they_say(qtbot: QtBot, card: ModeCard, selection: Selection) -> None:
    assert not card.remove_button.isEnabled()
    selection.select("opacity", 0)
    with qtbot.waitSignals([card.colorRequested, card.removeRequested], order="strict"):
        card.color_button.click()
        card.remove_button.click()
