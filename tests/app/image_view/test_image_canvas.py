import numpy as np
import pytest
from PIL import Image
from PySide6.QtGui import QColor, QImage, QPainter

from app.image_view.image_canvas import ImageCanvas, to_qimage
from app.image_view.picture import compose


def test_pixels_keep_their_place_and_value_within_the_range():
    rgba = np.zeros((2, 3, 4), dtype=np.float32)
    rgba[0, 2] = [1.0, 0.5, 0.0, 1.0]
    rgba[1, 0] = [-3.0, 7.0, np.nan, 1.0]
    image = to_qimage(rgba)
    assert (image.width(), image.height()) == (3, 2)
    assert image.pixelColor(2, 0).getRgb() == (255, 128, 0, 255)
    assert image.pixelColor(2, 1).getRgb() == (0, 0, 0, 255)
    assert image.pixelColor(0, 1).getRgb() == (0, 255, 0, 255)


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


def test_a_clear_image_shows_what_is_behind_it():
    rgba = np.float32([[[0.5, 0.25, 0.0, 0.5], [0, 0, 0, 0], [0.4, 0.2, 0.1, 1.0]]])
    image = to_qimage(rgba, clear=True)
    found = [image.pixelColor(x, 0).getRgb() for x in range(3)]
    assert found == [(255, 128, 0, 128), (0, 0, 0, 0), (102, 51, 26, 255)]


@pytest.fixture(scope="module")
def rgba():
    """Premultiplied colours of an odd size, over more than one band."""
    rng = np.random.default_rng(5)
    opacity = rng.uniform(0, 1, (131, 33, 1))
    color = rng.uniform(0, 1, (131, 33, 3)) * opacity
    return np.concatenate([color, opacity], axis=-1).astype(np.float32)


def pixels(image, tmp_name):
    """Read a picture as others do: from its file."""
    assert image.save(tmp_name)
    return np.asarray(Image.open(tmp_name))


@pytest.mark.parametrize("background", [(0, 0, 0), (255, 255, 255), (10, 200, 90)])
def test_an_opaque_picture_is_the_rendering_over_its_background(rgba, background, tmp_path):
    found = pixels(compose(rgba, background), f"{tmp_path}/picture.png")
    expected = 255 * rgba[..., :3] + (1 - rgba[..., 3:]) * np.array(background)
    np.testing.assert_allclose(found, expected, atol=0.51)


@pytest.mark.parametrize("brightness", [0.5, 3.0])
def test_a_picture_is_as_bright_as_on_the_screen(rgba, brightness, tmp_path):
    found = pixels(compose(rgba, (0, 0, 0), brightness=brightness), f"{tmp_path}/picture.png")
    largest = rgba[..., :3].max(axis=-1, keepdims=True)
    expected = 255 * brightness * rgba[..., :3] / (1 + (brightness - 1) * largest)
    np.testing.assert_allclose(found, expected, atol=0.51)
    levels = np.rint(255 * rgba).astype(np.uint8)
    saved = pixels(compose(levels, (0, 0, 0), brightness=brightness), f"{tmp_path}/levels.png")
    steepest = max(brightness, 1 / brightness)
    np.testing.assert_allclose(saved, expected, atol=0.5 * steepest + 0.51)
    # Over black, a transparent one looks the same.
    clear = pixels(compose(rgba, None, brightness=brightness), f"{tmp_path}/clear.png")
    over_black = clear[..., :3] * (clear[..., 3:] / 255)
    np.testing.assert_allclose(over_black, expected, atol=1.5)


def test_a_transparent_picture_is_unmultiplied_in_its_file(rgba, tmp_path):
    found = pixels(compose(rgba, None), f"{tmp_path}/picture.png").astype(float)
    np.testing.assert_allclose(found[..., 3], 255 * rgba[..., 3], atol=0.51)
    seen = rgba[..., 3] > 0.2
    straight = rgba[..., :3][seen] / rgba[..., 3:][seen]
    np.testing.assert_allclose(found[..., :3][seen], 255 * straight, atol=5)


def test_bad_values_do_no_harm_and_light_above_its_opacity_stays():
    rgba = np.zeros((1, 4, 4), np.float32)
    rgba[0, 0] = np.nan
    rgba[0, 1] = (3.0, -1.0, np.inf, 1.0)
    rgba[0, 2] = (0.5, 0.25, 0.0, 0.25)
    black = to_qimage(rgba)
    for image in (compose(rgba, (0, 0, 0)), compose(rgba, None), to_qimage(rgba, clear=True)):
        on_black = QImage(4, 1, QImage.Format.Format_RGB32)
        on_black.fill(QColor("black"))
        painter = QPainter(on_black)
        painter.drawImage(0, 0, image)
        painter.end()
        for x in range(4):
            assert on_black.pixelColor(x, 0) == black.pixelColor(x, 0)
