from functools import partial

import pytest
from mouse_events import drag
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QPushButton, QVBoxLayout, QWidget

from app import controls
from app.controls import Action
from app.window.notices import BOTTOM, SIDE, TOP, Floating, Notices


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


def shown_buttons(bar):
    return [b.text() for b in bar.findChildren(QPushButton) if b.isVisible()]


def test_of_many_notices_the_newest_are_shown(bar):
    for number in range(5):
        bar.add(f"notice {number}")
    assert bar.text.splitlines() == [f"notice {number}" for number in (4, 3, 2, 1, 0)]

    def seen():
        return [line.text for line in bar._lines if line.isVisible()]

    assert seen() == ["notice 4", "notice 3", "notice 2"]
    assert bar.more.isVisible() and bar.more.text() == "and 2 more"
    assert bar.dismiss_newest()
    assert seen() == ["notice 3", "notice 2", "notice 1"]
    assert bar.more.text() == "and 1 more"
    bar.clear()
    assert not bar.dismiss_newest()


def test_a_screen_reader_says_errors_at_once(bar, monkeypatch):
    said = []
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
    seen = []
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


class Card(QWidget):
    def __init__(self, width, height):
        super().__init__()
        self.content = QWidget()
        self.content.setFixedSize(width, height)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.content)
        self.hide()

    def grow(self, height):
        self.content.setFixedHeight(height)


@pytest.fixture
def area(qtbot):
    area = QWidget()
    qtbot.addWidget(area)
    area.resize(1000, 356)
    area.show()
    return area


def test_notices_stand_in_the_middle_and_cards_in_a_corner(qtbot, area):
    floating, notice, card = Floating(area), Card(480, 60), Card(320, 100)
    floating.add("top", notice)
    floating.add("bottom", card)
    for widget in (notice, card):
        assert not widget.isVisible()
        widget.show()
    assert notice.geometry() == QRect(260, TOP, 480, 60)
    assert card.geometry() == QRect(SIDE, 356 - BOTTOM - 100, 320, 100)
    area.resize(600, 400)
    assert notice.geometry() == QRect(60, TOP, 480, 60)
    assert card.geometry() == QRect(SIDE, 400 - BOTTOM - 100, 320, 100)
    image = QWidget(area)
    image.show()
    floating.set_corner_of(image)
    image.setGeometry(200, 0, 400, 400)
    assert card.x() == 200 + SIDE


def test_two_notices_are_listed_and_two_cards_stand_beside_each_other_where_there_is_room(
    qtbot, area
):
    floating = Floating(area)
    notices, cards = [Card(480, 50), Card(300, 40)], [Card(400, 120), Card(320, 100)]
    for notice in notices:
        floating.add("top", notice)
        notice.show()
    for card in cards:
        floating.add("bottom", card)
        card.show()
    assert notices[1].y() > notices[0].geometry().bottom()
    assert cards[0].geometry().bottom() == cards[1].geometry().bottom()
    assert cards[0].geometry().right() < cards[1].x()
    area.resize(600, 356)
    assert cards[1].geometry().bottom() < cards[0].y()
    notices[0].grow(90)
    qtbot.waitUntil(lambda: notices[1].y() == TOP + 90 + 8)


def test_a_card_is_dragged_stays_in_the_area_and_goes_back(qtbot, area):
    floating, card = Floating(area), Card(320, 100)
    floating.add("bottom", card)
    card.show()
    begun, left = card.geometry(), Qt.MouseButton.LeftButton
    grip = QPoint(20, 10)

    drag(card, grip, grip + QPoint(200, -50))
    assert card.geometry() == begun.translated(200, -50)
    # Without a button nothing moves.
    QTest.mouseMove(card, grip + QPoint(30, 30))
    assert card.geometry() == begun.translated(200, -50)
    drag(card, grip, grip + QPoint(2000, 2000))
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    area.resize(700, 300)
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    card.hide()
    card.show()
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    QTest.mouseDClick(card, left, pos=grip)
    assert card.geometry() == QRect(SIDE, 300 - BOTTOM - 100, 320, 100)
