import numpy as np
import pytest
from PySide6.QtGui import QColor

from app.image_view.image_canvas import ImageCanvas, to_qimage


def test_pixels_keep_their_place_and_value():
    rgba = np.zeros((2, 3, 4), dtype=np.float32)
    rgba[0, 2] = [1.0, 0.5, 0.0, 1.0]
    image = to_qimage(rgba)
    assert (image.width(), image.height()) == (3, 2)
    assert image.pixelColor(2, 0).getRgb() == (255, 128, 0, 255)
    assert image.pixelColor(2, 1).getRgb() == (0, 0, 0, 255)


@pytest.fixture
def canvas(qtbot):
    canvas = ImageCanvas()
    qtbot.addWidget(canvas)
    canvas.resize(300, 100)
    return canvas


def color_at(canvas, x, y):
    return canvas.grab().toImage().pixelColor(x, y)


def test_the_image_is_shown_centred_with_its_own_shape(canvas):
    canvas.show_image(to_qimage(np.ones((8, 8, 4), dtype=np.float32)))
    assert color_at(canvas, 150, 50) == QColor("white")
    assert color_at(canvas, 105, 5) == QColor("white")
    assert color_at(canvas, 90, 50) == QColor("black")
    assert color_at(canvas, 210, 50) == QColor("black")


@pytest.mark.parametrize(("value", "level"), [(-3.0, 0), (7.0, 255), (np.nan, 0)])
def test_values_outside_the_range_are_clipped(value, level):
    rgba = np.full((1, 1, 4), value, dtype=np.float32)
    assert to_qimage(rgba).pixelColor(0, 0).red() == level


def test_a_clear_image_shows_what_is_behind_it():
    rgba = np.float32([[[0.5, 0.25, 0.0, 0.5], [0, 0, 0, 0], [0.4, 0.2, 0.1, 1.0]]])
    image = to_qimage(rgba, clear=True)
    found = [image.pixelColor(x, 0).getRgb() for x in range(3)]
    assert found == [(255, 128, 0, 128), (0, 0, 0, 0), (102, 51, 26, 255)]
