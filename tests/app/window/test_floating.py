from __future__ import annotations

import pytest
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QVBoxLayout, QWidget

from app.window.notices import BOTTOM, SIDE, TOP, Floating


class Card(QWidget):
    """A widget of some size."""

    def __init__(self, width: int, height: int) -> None:
        super().__init__()
        self.content = QWidget()
        self.content.setFixedSize(width, height)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.content)
        self.hide()

    def grow(self, height: int) -> None:
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

    def drag(by: QPoint) -> None:
        QTest.mousePress(card, left, pos=grip)
        QTest.mouseMove(card, grip + by)
        QTest.mouseRelease(card, left, pos=grip)

    drag(QPoint(200, -50))
    assert card.geometry() == begun.translated(200, -50)
    # Without a button nothing moves.
    QTest.mouseMove(card, grip + QPoint(30, 30))
    assert card.geometry() == begun.translated(200, -50)
    drag(QPoint(2000, 2000))
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    area.resize(700, 300)
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    card.hide()
    card.show()
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    QTest.mouseDClick(card, left, pos=grip)
    assert card.geometry() == QRect(SIDE, 300 - BOTTOM - 100, 320, 100)
