from __future__ import annotations

from functools import partial

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QPushButton, QVBoxLayout, QWidget

from app import controls
from app.controls import Action
from app.window.notices import Notices


@pytest.fixture
def bar(qtbot):
    window = QWidget()
    window.resize(520, 400)
    bar = Notices()
    column = QVBoxLayout(window)
    column.addWidget(bar)
    column.addStretch()
    qtbot.addWidget(window)
    with qtbot.waitActive(window):
        window.show()
        window.activateWindow()
    yield bar
    window.close()


def shown_buttons(bar: Notices) -> list[str]:
    return [b.text() for b in bar.findChildren(QPushButton) if b.isVisible()]


def test_of_many_notices_the_newest_are_shown(bar):
    for number in range(5):
        bar.add(f"notice {number}")
    assert bar.text.splitlines() == [f"notice {number}" for number in (4, 3, 2, 1, 0)]

    def seen() -> list[str]:
        return [line.text for line in bar._lines if line.isVisible()]

    assert seen() == ["notice 4", "notice 3", "notice 2"]
    assert bar.more.isVisible() and bar.more.text() == "and 2 more"
    assert bar.dismiss_newest()
    assert seen() == ["notice 3", "notice 2", "notice 1"]
    assert bar.more.text() == "and 1 more"
    bar.clear()
    assert not bar.dismiss_newest()


def test_a_screen_reader_says_errors_at_once(bar, monkeypatch):
    said: list[tuple[str, str]] = []
    monkeypatch.setattr(
        controls.QAccessible,
        "updateAccessibility",
        lambda event: said.append((event.message(), event.politeness().name)),
    )
    bar.add("It is found.")
    bar.add("It failed.", tone="error")
    assert said == [("It is found.", "Polite"), ("It failed.", "Assertive")]
    assert [line.property("tone") for line in bar._lines] == ["error", "plain"]
    assert bar._lines[0].accessibleName() == "Error: It failed."


def test_a_notice_replaces_the_one_of_its_key(bar):
    bar.add("no model", key="model")
    bar.add("an error")
    bar.add("another model", key="model")
    assert bar.text == "another model\nan error"
    bar.clear("model")
    bar.clear("unknown")
    assert bar.text == "an error"
    bar.add("no model", key="model")
    bar.add("")
    assert bar.text == "no model\nan error"
    bar.add("", key="model")
    assert bar.text == "an error"


def test_a_button_acts_once_and_removes_its_notice_first(qtbot, bar):
    seen: list[str] = []
    bar.add("below")
    bar.add(
        "found",
        Action("Open", lambda: seen.append(bar.text)),
        Action("Locate…", partial(bar.add, "located")),
    )
    assert shown_buttons(bar) == ["Open", "Locate…"]
    button = next(b for b in bar.findChildren(QPushButton) if b.text() == "Open")
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
    assert seen == ["below"] and bar.text == "below"
    with pytest.raises(ValueError, match="room"):
        bar.add("crowded", *[Action("x", list)] * 3)


def test_escape_dismisses_one_after_another(qtbot, bar):
    bar.add("two")
    bar.add("one", Action("Act", list))
    bar.findChildren(QPushButton)[0].setFocus()
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Escape)
    assert bar.text == "two"
    qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Escape)
    assert bar.text == "" and not bar.isVisible()
