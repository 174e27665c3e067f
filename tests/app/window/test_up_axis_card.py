from __future__ import annotations

import base64

from PySide6.QtGui import QColor, QImage
from pytestqt.qtbot import QtBot

from app.window.up_axis_question import ICON, UpAxisCard
from model.scene.axes import AXES


def test_each_button_answers_with_its_axis(qtbot: QtBot) -> None:
    bar = UpAxisCard()
    qtbot.addWidget(bar)
    chosen: list[str] = []
    bar.chosen.connect(chosen.append)
    assert not bar.isVisible()
    for axis in AXES:
        bar.ask("+z")
        assert bar.isVisible()
        assert bar.button("+z").isChecked()
        bar.button(axis).click()
        assert not bar.isVisible()
    assert tuple(chosen) == AXES


def test_pictures_are_shown_and_forgotten_at_the_next_question(qtbot: QtBot) -> None:
    bar = UpAxisCard()
    qtbot.addWidget(bar)
    bar.ask()
    image = QImage(128, 64, QImage.Format.Format_RGB888)
    image.fill(QColor("red"))
    bar.set_pictures({"+y": image})
    icon = bar.button("+y").icon()
    assert icon.availableSizes()[0].width() == ICON
    assert icon.pixmap(ICON).toImage().pixelColor(36, 18) == QColor("red")
    # The mouse shows it in full.
    tip = bar.button("+y").toolTip()
    shown = QImage.fromData(base64.b64decode(tip.split("base64,")[1].split("'")[0]))
    assert shown.size() == image.size() and "+y of its file at the top" in tip
    # Black, and as large: nothing moves when a picture comes.
    black = bar.button("-y").icon().pixmap(ICON).toImage()
    assert (black.width(), black.pixelColor(36, 18)) == (ICON, QColor("black"))
    bar.ask()
    assert bar.button("+y").icon().pixmap(ICON).toImage().pixelColor(36, 18) == QColor("black")
