from __future__ import annotations

import pytest
from PySide6.QtGui import QColor, QIcon
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from app.icons import BUTTON, IconButton, icon, icon_names
from app.theme import DARK, LIGHT, apply_theme


@pytest.mark.parametrize("name", icon_names())
def test_an_icon_is_drawn_in_the_texts_colour(qapp: QApplication, name: str) -> None:
    for colors in (DARK, LIGHT):
        image = icon(name, colors).pixmap(18, 18).toImage()
        # Antialiased lines of one colour: what is opaque has it.
        solid = {
            image.pixelColor(x, y).name()
            for x in range(image.width())
            for y in range(image.height())
            if image.pixelColor(x, y).alpha() == 255
        }
        assert solid <= {QColor(colors.text).name()}
        inked = sum(
            image.pixelColor(x, y).alpha() > 60
            for x in range(image.width())
            for y in range(image.height())
        )
        assert inked > 10


def test_a_button_says_its_name_and_key_and_follows_the_theme(
    qtbot: QtBot, qapp: QApplication
) -> None:
    button = IconButton("camera", "Save figure", "Ctrl+Shift+S", "With its legend")
    qtbot.addWidget(button)
    assert button.accessibleName() == "Save figure"
    assert button.toolTip() == "Save figure (Ctrl+Shift+S)\nWith its legend"
    assert (button.width(), button.height()) == (BUTTON, BUTTON)

    def ink() -> set[str]:
        image = button.icon().pixmap(18, 18, QIcon.Mode.Normal).toImage()
        pixels = (image.pixelColor(x, y) for x in range(18) for y in range(18))
        return {color.name() for color in pixels if color.alpha() == 255}

    before = ink()
    try:
        apply_theme(qapp, "light")
        qapp.processEvents()
        assert ink() != before
    finally:
        apply_theme(qapp, "dark")
