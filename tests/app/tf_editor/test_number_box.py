from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from app.tf_editor.number_box import NumberBox


@pytest.fixture
def box(qtbot: QtBot) -> NumberBox:
    box = NumberBox()
    qtbot.addWidget(box)
    return box


def type_number(box: NumberBox, text: str) -> None:
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


@pytest.mark.parametrize(
    ("limits", "text", "value"),
    [
        ((0.0, 1.0), "0.25", 0.25),
        ((0.0, 1.0), "0,25", 0.25),
        ((-1000.0, 3000.0), "-12.5", -12.5),
        ((1e-9, 3e-9), "2.5e-9", 2.5e-9),
        ((0.0, 1e12), "3e11", 3e11),
    ],
)
def test_a_typed_number_counts_at_enter(
    qtbot: QtBot, box: NumberBox, limits: tuple[float, float], text: str, value: float
) -> None:
    box.set_limits(*limits)
    with qtbot.waitSignal(box.valueChanged) as changed:
        type_number(box, text)
    assert changed.args == [pytest.approx(value, rel=1e-6)]


@pytest.mark.parametrize(("text", "side"), [("5", "above"), ("-3", "below")])
def test_a_number_outside_stays_and_says_so(box: NumberBox, text: str, side: str) -> None:
    box.show()
    box.show_value(0.5)
    type_number(box, text)
    assert box.value() == 0.5 and box.text() == text
    assert box.entry.reason == f"{text} is {side} the limits: from 0 to 1."


def test_a_number_inside_is_taken_without_a_word(box: NumberBox) -> None:
    box.show()
    box.set_limits(-2.5, 1e6)
    assert box.toolTip() == "From -2.5 to 1e+06"
    type_number(box, "100 000")
    assert box.value() == 100_000 and not box.entry.reason


def test_shown_digits_just_beyond_the_limits_are_no_entry(qtbot: QtBot, box: NumberBox) -> None:
    box.set_limits(0.0, 2 / 3)
    box.show_value(2 / 3)
    assert float(box.text()) > 2 / 3
    QTest.keyClick(box, Qt.Key.Key_Return)
    assert not box.entry.reason and box.value() == pytest.approx(2 / 3, abs=1e-9)


def test_nonsense_changes_nothing(box: NumberBox) -> None:
    box.show_value(0.5)
    type_number(box, "e-")
    assert box.value() == 0.5 and box.text() == "e-"
    assert box.entry.reason == "“e-” is not a number."


def test_enter_without_typing_keeps_hidden_digits(qtbot: QtBot, box: NumberBox) -> None:
    box.show_value(1 / 3)
    exact = box.value()
    with qtbot.assertNotEmitted(box.valueChanged):
        QTest.keyClick(box, Qt.Key.Key_Return)
    assert box.text() == "0.3333"
    assert box.value() == exact


def test_a_value_from_outside_is_silent(qtbot: QtBot, box: NumberBox) -> None:
    with qtbot.assertNotEmitted(box.valueChanged):
        box.set_limits(5.0, 6.0)
        box.show_value(5.5)
    assert box.text() == "5.5"


def test_a_small_range_far_from_zero_keeps_its_digits(box: NumberBox) -> None:
    box.set_limits(1e6, 1e6 + 1)
    type_number(box, "1000000.5")
    assert box.value() == pytest.approx(1000000.5, abs=1e-9)
    assert float(box.text()) == pytest.approx(1000000.5, abs=1e-5)
    shown = box.text()
    type_number(box, shown)
    assert box.value() == pytest.approx(1000000.5, abs=1e-9)
