from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QToolTip, QWidget
from pytestqt.qtbot import QtBot

from app.number_entry import NumberKeys, WholeNumberBox
from app.tf_editor.number_box import NumberBox


@pytest.fixture
def window(qtbot: QtBot) -> QWidget:
    window = QWidget()
    qtbot.addWidget(window)
    return window


def shortcuts(window: QWidget, *keys: str) -> list[str]:
    """Keys that have reached the window."""
    heard: list[str] = []
    for key in keys:
        shortcut = QShortcut(key, window)
        shortcut.activated.connect(lambda key=key: heard.append(key))
    return heard


@pytest.mark.parametrize("kind", [NumberBox, WholeNumberBox])
def test_after_enter_keys_are_the_windows(
    qtbot: QtBot, window: QWidget, kind: type[NumberBox] | type[WholeNumberBox]
) -> None:
    heard = shortcuts(window, "Ctrl+Z", "R")
    box = kind(window)
    if kind is WholeNumberBox:
        NumberKeys(box)
    window.show()
    qtbot.waitExposed(window)
    box.setFocus()
    qtbot.waitUntil(box.hasFocus)
    # What types no number is never the box's, and nothing has been typed to be taken back.
    QTest.keyClick(box, Qt.Key.Key_R)
    QTest.keyClick(box, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert heard == ["R", "Ctrl+Z"]
    box.selectAll()
    QTest.keyClicks(box, "1")
    QTest.keyClick(box, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert heard == ["R", "Ctrl+Z"]
    QTest.keyClicks(box, "1")
    QTest.keyClick(box, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: not box.hasFocus())
    QTest.keyClick(window, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert heard == ["R", "Ctrl+Z", "Ctrl+Z"]


@pytest.mark.parametrize(
    ("typed", "taken"), [("400", 109), ("-7", 0), ("50", 50), ("", 7), ("99999999999", 109)]
)
def test_a_whole_number_out_of_range_becomes_the_nearest(
    qtbot: QtBot, typed: str, taken: int
) -> None:
    box = WholeNumberBox()
    qtbot.addWidget(box)
    box.setRange(0, 109)
    box.setValue(7)
    box.show()
    box.selectAll()
    QTest.keyClick(box, Qt.Key.Key_Delete)
    QTest.keyClicks(box, typed)
    assert box.lineEdit().text() == typed
    QTest.keyClick(box, Qt.Key.Key_Return)
    assert box.value() == taken
    if taken in (0, 109):
        assert "From 0 to 109" in QToolTip.text()
    QTest.keyClicks(box, "x")
    assert "x" not in box.lineEdit().text()
