from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from app.number_entry import WholeNumberBox, first_refused
from app.tf_editor.number_box import NumberBox


@pytest.fixture
def window(qtbot: QtBot) -> QWidget:
    window = QWidget()
    QVBoxLayout(window)
    qtbot.addWidget(window)
    return window


@pytest.fixture
def boxes(qtbot: QtBot, window: QWidget) -> tuple[WholeNumberBox, NumberBox]:
    """Two boxes of a window that is active, the first one with the focus."""
    pixels, value = WholeNumberBox(), NumberBox()
    pixels.setRange(16, 8192)
    pixels.setSuffix(" px")
    pixels.setKeyboardTracking(False)
    pixels.show_value(1572)
    value.set_limits(-1024, 2986)
    value.show_value(40)
    for box in (pixels, value):
        window.layout().addWidget(box)
    window.show()
    qtbot.waitExposed(window)
    window.activateWindow()
    pixels.setFocus()
    qtbot.waitUntil(pixels.hasFocus)
    return pixels, value


def shortcuts(window: QWidget, *keys: str) -> list[str]:
    """Keys that have reached the window."""
    heard: list[str] = []
    for key in keys:
        shortcut = QShortcut(key, window)
        shortcut.activated.connect(lambda key=key: heard.append(key))
    return heard


def type_over(box: WholeNumberBox | NumberBox, text: str) -> None:
    box.selectAll()
    QTest.keyClicks(box, text)


@pytest.mark.parametrize("kind", [NumberBox, WholeNumberBox])
def test_after_enter_keys_are_the_windows(
    qtbot: QtBot, window: QWidget, kind: type[NumberBox] | type[WholeNumberBox]
) -> None:
    heard = shortcuts(window, "Ctrl+Z", "R")
    box = kind(window)
    window.show()
    qtbot.waitExposed(window)
    box.setFocus()
    qtbot.waitUntil(box.hasFocus)
    # Whoever types a letter means no command; nothing has been typed to be taken back.
    QTest.keyClick(box, Qt.Key.Key_R)
    QTest.keyClick(box, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert heard == ["Ctrl+Z"]
    type_over(box, "1")
    QTest.keyClick(box, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert heard == ["Ctrl+Z"]
    type_over(box, "1")
    QTest.keyClick(box, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: not box.hasFocus())
    QTest.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    QTest.keyClick(window, Qt.Key.Key_R)
    assert heard == ["Ctrl+Z", "Ctrl+Z", "R"]


@pytest.mark.parametrize("typed", ["2000", "2 000", "2,000", "2000 px", "2000px"])
def test_tab_takes_a_size(
    qtbot: QtBot, boxes: tuple[WholeNumberBox, NumberBox], typed: str
) -> None:
    pixels, value = boxes
    type_over(pixels, typed)
    QTest.keyClick(pixels, Qt.Key.Key_Tab)
    assert value.hasFocus()
    assert pixels.value() == 2000 and pixels.text() == "2000 px" and not pixels.entry.reason


@pytest.mark.parametrize(
    ("key", "typed", "said"),
    [
        (Qt.Key.Key_Tab, "9000", "9000 is above the limits: from 16 to 8192."),
        (Qt.Key.Key_Return, "9000", "9000 is above the limits: from 16 to 8192."),
        (Qt.Key.Key_Tab, "7 px", "7 is below the limits: from 16 to 8192."),
        (Qt.Key.Key_Tab, "12,3", "“12,3” is not a whole number."),
    ],
)
def test_what_is_not_taken_stays_and_says_why(
    boxes: tuple[WholeNumberBox, NumberBox], key: Qt.Key, typed: str, said: str
) -> None:
    pixels, _ = boxes
    type_over(pixels, typed)
    QTest.keyClick(pixels, key)
    assert pixels.value() == 1572 and pixels.lineEdit().text().startswith(typed)
    assert pixels.entry.reason == said
    # Whoever comes back mends it.
    pixels.setFocus()
    type_over(pixels, "900")
    assert not pixels.entry.reason
    QTest.keyClick(pixels, Qt.Key.Key_Tab)
    assert pixels.value() == 900 and not pixels.property("refused")


def test_a_refused_number_stays_while_others_are_taken(
    boxes: tuple[WholeNumberBox, NumberBox],
) -> None:
    pixels, value = boxes
    type_over(pixels, "9000")
    QTest.keyClick(pixels, Qt.Key.Key_Tab)
    type_over(value, "1.234,5")
    QTest.keyClick(value, Qt.Key.Key_Return)
    assert value.value() == 1234.5
    pixels.show_value(1572)
    assert pixels.lineEdit().text() == "9000 px" and pixels.entry.reason
    pixels.show_value(100)
    assert pixels.text() == "100 px" and not pixels.entry.reason


def test_escape_brings_the_last_number_back(boxes: tuple[WholeNumberBox, NumberBox]) -> None:
    pixels, _ = boxes
    type_over(pixels, "9000")
    QTest.keyClick(pixels, Qt.Key.Key_Return)
    assert pixels.hasFocus() and pixels.entry.reason
    QTest.keyClick(pixels, Qt.Key.Key_Escape)
    assert pixels.text() == "1572 px" and not pixels.entry.reason


def test_escape_takes_no_half_typed_number(boxes: tuple[WholeNumberBox, NumberBox]) -> None:
    pixels, value = boxes
    for box, typed in ((pixels, "1400"), (value, "14")):
        before, taken = box.value(), []
        box.valueChanged.connect(taken.append)
        box.setFocus()
        type_over(box, typed)
        QTest.keyClick(box, Qt.Key.Key_Escape)
        QTest.keyClick(box, Qt.Key.Key_Tab)
        assert box.value() == before and not taken


def test_a_dialog_finds_what_is_refused(
    window: QWidget, boxes: tuple[WholeNumberBox, NumberBox]
) -> None:
    _, value = boxes
    assert first_refused(window) is None
    type_over(value, "40000")
    assert first_refused(window) is value and value.hasFocus()
    type_over(value, "400")
    assert first_refused(window) is None


def test_wider_limits_take_what_was_refused(
    qtbot: QtBot, boxes: tuple[WholeNumberBox, NumberBox]
) -> None:
    _, value = boxes
    value.setFocus()
    type_over(value, "5000")
    QTest.keyClick(value, Qt.Key.Key_Return)
    assert value.value() == 40 and value.entry.reason
    with qtbot.waitSignal(value.valueChanged):
        value.set_limits(-1024, 8000)
        value.show_value(40)
    assert value.value() == 5000 and not value.entry.reason


def test_letters_are_not_typed(boxes: tuple[WholeNumberBox, NumberBox]) -> None:
    for box in boxes:
        type_over(box, "5z")
        assert "z" not in box.lineEdit().text()
