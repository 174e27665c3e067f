import pytest
from PySide6.QtGui import QColor

from app.icons import icon, icon_names
from app.theme import DARK, LIGHT


@pytest.mark.parametrize("name", icon_names())
def test_an_icon_is_drawn_in_the_texts_colour(qapp, name):
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
