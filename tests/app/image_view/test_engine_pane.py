import threading
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QImage, QPainter
from rested_window import act_until
from window_fakes import FakeEngine, make_request

from app.engines import requests
from app.engines.messages import Result
from app.image_view.image_canvas import to_qimage
from app.picture import compose
from model.scene.view import View


def red(pane):
    """Sequence number of the image that is shown."""
    return pane.canvas.image.pixelColor(0, 0).red()


def test_images_are_shown_brighter_at_once(qtbot, pane):
    pane.client.start(FakeEngine, "Loading …")
    pane.brightness.set(2.0)
    act_until(qtbot, pane.client.settled, pane.client.submit, make_request(7))
    assert red(pane) == 14
    pane.brightness.set(0.5)
    assert red(pane) == 4
    # Of a failed engine, the message stays.
    pane.client.fail("It failed.")
    pane.brightness.set(1.0)
    assert red(pane) == 7 and pane.canvas.message == "It failed."


def test_an_image_that_is_not_up_to_date_says_so_once_the_next_takes_long(qtbot, pane):
    engine = FakeEngine(gate=threading.Semaphore(1))
    pane.client.start(lambda *_: engine, "Loading …")
    act_until(qtbot, pane.client.settled, pane.client.submit, make_request(1))
    assert pane.caption.detail != "drawing …"
    # A finer image of the same inputs: what is shown is right.
    pane.client.submit(make_request(2))
    assert pane.caption.detail != "drawing …" and not pane._patience.isActive()
    turned = replace(make_request(3), inputs=replace(make_request(3).inputs, view=View(80.0)))
    pane.client.submit(turned)
    assert pane.caption.detail != "drawing …"
    qtbot.waitUntil(lambda: pane.caption.detail == "drawing …")
    engine.gate.release(2)
    qtbot.waitUntil(lambda: red(pane) == 3)
    assert pane.caption.detail != "drawing …"
    # Under another light, an image of the same inputs is another one, as of B.
    engine.gate, lit = threading.Semaphore(0), requests.ReferenceSettings(lighting="soft")
    pane.client.submit(replace(turned, sequence=4, settings=lit))
    qtbot.waitUntil(lambda: pane.caption.detail == "drawing …")
    engine.gate.release(1)
    qtbot.waitUntil(lambda: pane.caption.detail != "drawing …")
    # Another engine has another light.
    gate = threading.Semaphore(0)
    pane.client.start(lambda: FakeEngine(gate=gate), "")
    pane.client.submit(replace(turned, sequence=5))
    qtbot.waitUntil(lambda: pane.caption.detail == "drawing …")
    pane.client.fail("It failed.")
    assert pane.caption.detail != "drawing …"
    gate.release()


def test_fewer_samples_of_the_same_scene_are_shown_only_at_the_end(pane):
    def shown(level, samples, is_last=False):
        rgba = np.full((4, 4, 4), [level / 255, 0, 0, 1], dtype=np.float32)
        image = requests.Image(rgba, 0.1, samples=samples, is_last=is_last)
        pane.channel.answered.emit(Result(make_request(level), image))
        return red(pane)

    seen = [shown(1, 1), shown(2, 8), shown(3, 1), shown(4, 8), shown(5, 1), shown(6, 4, True)]
    assert seen == [1, 2, 2, 4, 4, 6]
    # In another light it is another picture.
    pane.set_light("path-traced light", most_samples=8)
    assert shown(7, 2) == 7 and pane.caption.detail == "path traced, 2 of 8 samples"
    # Nothing is said twice.
    pane.title = "B, path-traced light"
    assert pane.caption.detail == "2 of 8 samples"


def test_pixels_keep_their_place_and_value_within_the_range():
    rgba = np.zeros((2, 3, 4), dtype=np.float32)
    rgba[0, 2] = [1.0, 0.5, 0.0, 1.0]
    rgba[1, 0] = [-3.0, 7.0, np.nan, 1.0]
    image = to_qimage(rgba)
    assert (image.width(), image.height()) == (3, 2)
    assert image.pixelColor(2, 0).getRgb() == (255, 128, 0, 255)
    assert image.pixelColor(2, 1).getRgb() == (0, 0, 0, 255)
    assert image.pixelColor(0, 1).getRgb() == (0, 255, 0, 255)
    # Without opacity, they are opaque, also over something transparent.
    ground = QImage(3, 2, QImage.Format.Format_ARGB32_Premultiplied)
    ground.fill(Qt.GlobalColor.transparent)
    with QPainter(ground) as painter:
        painter.drawImage(QRectF(ground.rect()), to_qimage(np.full((1, 3, 3), 0.5)))
    assert ground.pixelColor(1, 1).getRgb() == (128, 128, 128, 255)


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
    # Over white and without a background, only what a pixel itself shows is brighter.
    opacity = rgba[..., 3:]
    itself = rgba[..., :3] / opacity
    largest = itself.max(axis=-1, keepdims=True)
    expected = 255 * opacity * brightness * itself / (1 + (brightness - 1) * largest)
    white = pixels(compose(rgba, (255, 255, 255), brightness=brightness), f"{tmp_path}/white.png")
    np.testing.assert_allclose(white, expected + 255 * (1 - opacity), atol=0.51)
    clear = pixels(compose(rgba, None, brightness=brightness), f"{tmp_path}/clear.png")
    np.testing.assert_allclose(clear[..., :3] * (clear[..., 3:] / 255), expected, atol=1.5)
    shown = to_qimage(rgba, brightness, clear=True).convertToFormat(QImage.Format.Format_RGBA8888)
    np.testing.assert_allclose(pixels(shown, f"{tmp_path}/shown.png"), clear, atol=1)


def test_a_transparent_picture_is_unmultiplied_in_its_file(rgba, tmp_path):
    found = pixels(compose(rgba, None), f"{tmp_path}/picture.png").astype(float)
    np.testing.assert_allclose(found[..., 3], 255 * rgba[..., 3], atol=0.51)
    seen = rgba[..., 3] > 0.2
    straight = rgba[..., :3][seen] / rgba[..., 3:][seen]
    np.testing.assert_allclose(found[..., :3][seen], 255 * straight, atol=5)
