from __future__ import annotations

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from app.controls import Action
from app.image_view.banner import Banner
from app.image_view.image_canvas import ImageCanvas

SENTENCE = "The TF shows only scalar values from 300 to 400, but the volume's lie between 0 and 9."


@pytest.fixture
def canvas(qtbot: QtBot) -> ImageCanvas:
    canvas = ImageCanvas()
    qtbot.addWidget(canvas)
    canvas.resize(700, 500)
    canvas.show()
    return canvas


def test_it_stays_in_the_lower_middle(canvas: ImageCanvas) -> None:
    banner = Banner(canvas)
    assert banner.text == "" and not banner.isVisible()
    banner.show_text(SENTENCE, Action("Default TF", list))
    for width, height in ((700, 500), (300, 260), (1200, 900)):
        canvas.resize(width, height)
        box = banner.geometry()
        assert canvas.rect().contains(box)
        assert abs(box.center().x() - canvas.rect().center().x()) <= 1
        assert box.top() > height / 2 - 60
        assert box.height() >= banner.heightForWidth(box.width())


def test_a_button_hides_it_and_acts(qtbot: QtBot, canvas: ImageCanvas) -> None:
    banner = Banner(canvas)
    seen: list[str] = []
    banner.show_text("first", Action("Old", lambda: seen.append("old")))
    banner.show_text(
        SENTENCE,
        Action("Default TF", lambda: seen.append("tf")),
        Action("Reset view", lambda: seen.append("view")),
    )
    buttons = {b.text(): b for b in banner.findChildren(QPushButton) if b.isVisible()}
    assert list(buttons) == ["Default TF", "Reset view"]
    qtbot.mouseClick(buttons["Reset view"], Qt.MouseButton.LeftButton)
    assert seen == ["view"] and banner.text == ""


def test_escape_hides_it(qtbot: QtBot, canvas: ImageCanvas) -> None:
    banner = Banner(canvas)
    banner.show_text("Nothing.")
    qtbot.keyClick(banner, Qt.Key.Key_Escape)
    assert not banner.isVisible()
    canvas.resize(400, 300)
    assert not banner.isVisible()
