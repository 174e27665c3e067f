from __future__ import annotations

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
