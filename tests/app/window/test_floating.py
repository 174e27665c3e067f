from __future__ import annotations

import pytest
from PySide6.QtCore import QRect
from PySide6.QtWidgets import QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from app.window.floating import BOTTOM, TOP, Floating


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
def area(qtbot: QtBot) -> QWidget:
    area = QWidget()
    qtbot.addWidget(area)
    area.resize(1000, 356)
    area.show()
    return area


def test_what_floats_stands_in_the_middle_and_follows_the_area(qtbot: QtBot, area: QWidget) -> None:
    floating, notice, card = Floating(area), Card(480, 60), Card(320, 100)
    floating.add_top(notice)
    floating.add_bottom(card)
    for widget in (notice, card):
        assert not widget.isVisible()
        widget.show()
    assert notice.geometry() == QRect(260, TOP, 480, 60)
    assert card.geometry() == QRect(340, 356 - BOTTOM - 100, 320, 100)
    area.resize(600, 400)
    assert notice.geometry() == QRect(60, TOP, 480, 60)
    assert card.geometry() == QRect(140, 400 - BOTTOM - 100, 320, 100)


def test_two_notices_are_listed_and_two_cards_stand_beside_each_other_where_there_is_room(
    qtbot: QtBot, area: QWidget
) -> None:
    floating = Floating(area)
    notices, cards = [Card(480, 50), Card(300, 40)], [Card(400, 120), Card(320, 100)]
    for notice in notices:
        floating.add_top(notice)
        notice.show()
    for card in cards:
        floating.add_bottom(card)
        card.show()
    assert notices[1].y() > notices[0].geometry().bottom()
    assert cards[0].geometry().bottom() == cards[1].geometry().bottom()
    assert cards[0].geometry().right() < cards[1].x()
    area.resize(600, 356)
    assert cards[1].geometry().bottom() < cards[0].y()
    notices[0].grow(90)
    qtbot.waitUntil(lambda: notices[1].y() == TOP + 90 + 8)


def test_cards_stand_in_the_middle_of_what_is_named(qtbot: QtBot, area: QWidget) -> None:
    floating, card, image = Floating(area), Card(320, 100), QWidget(area)
    image.setGeometry(600, 0, 400, 356)
    image.show()
    floating.add_bottom(card)
    card.show()
    floating.set_middle_of(image)
    assert card.geometry() == QRect(640, 356 - BOTTOM - 100, 320, 100)
    # Never beyond the area.
    image.setGeometry(900, 0, 100, 356)
    floating.set_middle_of(image)
    assert card.geometry().right() < 1000
