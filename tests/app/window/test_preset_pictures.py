from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from PySide6.QtGui import QColor, QImage
from PySide6.QtWidgets import QMenu
from pytestqt.qtbot import QtBot
from window_fakes import FakeBuilders, FakeEngine

from app.engines.requests import BatchRequest
from app.tf_editor.preset_menu import FOLDED, PICTURE
from app.window.main_window import MainWindow
from app.window.preset_pictures import contrast, is_nearly_black


def test_each_preset_shows_the_volume_and_can_be_taken(
    qtbot: QtBot, make_window: Callable[..., MainWindow], builders: FakeBuilders
) -> None:
    window = make_window(model=None)
    menu, state = window.editor.menu.presets, window.state
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    window.brightness.set(1.0)
    menu.aboutToShow.emit()

    def asked() -> list[BatchRequest]:
        return [r for r in builders.analysts[-1].others if r.channel == "presets"]

    qtbot.waitUntil(lambda: bool(asked()))
    request, entries = asked()[-1], menu.actions()
    assert len(entries) == 1 + len(request.more)
    # From the same side, with all that is shown in the middle of the square.
    assert request.inputs.view.basis() == pytest.approx(state.view.basis())
    assert request.inputs.view == state.for_picture(state.view)

    def level(number: int) -> int:
        image = entries[number].icon().pixmap(PICTURE, PICTURE).toImage()
        return image.pixelColor(PICTURE // 2, PICTURE // 2).red()

    # The fake's pictures are each .1 brighter than the one before.
    qtbot.waitUntil(lambda: level(3) > 0)
    assert [level(n) for n in (0, 1, 3)] == pytest.approx([0, 26, 76], abs=1)
    entries[2].trigger()
    assert state.transfer_function.opacity == request.more[1].opacity_tf
    assert state.edits.stack.undoText() == f"preset {entries[2].text()}"
    menu.aboutToShow.emit()
    menu.actions()[0].trigger()
    assert state.transfer_function == state.default_transfer_function
    # All of them leave the range as it is.
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.editor.range.set_range((120.0, 160.0))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    menu.aboutToShow.emit()
    # Another analyst, of the new range.
    qtbot.waitUntil(lambda: bool(asked()))
    for inputs in (asked()[-1].inputs, *asked()[-1].more):
        assert inputs.opacity_tf.scalar_range == (120.0, 160.0)
    for number in range(len(menu.actions())):
        menu.actions()[number].trigger()
        assert state.scalar_range == (120.0, 160.0)


def test_presets_are_ordered_by_what_they_show_and_stay_while_the_menu_is_open(
    qtbot: QtBot,
    make_window: Callable[..., MainWindow],
    builders: FakeBuilders,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def pictures(engine: FakeEngine, request: BatchRequest, *_: object) -> np.ndarray:
        """The default's is flat; the others are half black, the later the brighter, but for
        the last one, which is black."""
        engine.others.append(request)
        images = np.zeros((1 + len(request.more), *request.quality.pixels.shape, 4), np.float32)
        images[..., 3] = 1.0
        images[0, ..., :3] = 0.5
        for number in range(1, len(images) - 1):
            images[number, :, ::2, :3] = number / len(images)
        return images

    monkeypatch.setattr(FakeEngine, "images", pictures)
    window = make_window(model=None)
    menu = window.editor.menu.presets
    usual = [preset.name for preset in menu.listed()]
    # Asked for before anybody opens the menu.
    qtbot.waitUntil(lambda: [preset.name for preset in menu.listed()] != usual)
    menu.aboutToShow.emit()
    shown = [action.text() for action in menu.actions()]
    assert shown == [usual[0], *reversed(usual[1:-1]), FOLDED]
    black = menu.actions()[-1].menu()
    assert isinstance(black, QMenu)
    assert [action.text() for action in black.actions()] == [usual[-1]]
    count = len([r for r in builders.analysts[-1].others if r.channel == "presets"])
    assert count >= 1
    qtbot.waitUntil(lambda: not menu.actions()[1].icon().isNull())
    assert [action.text() for action in menu.actions()] == shown
    # One that is folded can be taken all the same.
    black.actions()[0].trigger()
    assert window.state.edits.stack.undoText() == f"preset {usual[-1]}"


@pytest.mark.parametrize(("levels", "expected"), [((0, 0), 0.0), ((0, 255), 0.5), ((9, 9), 0.0)])
def test_contrast_is_the_deviation_of_the_brightness(
    levels: tuple[int, int], expected: float
) -> None:
    image = QImage(6, 4, QImage.Format.Format_RGB888)
    image.fill(QColor(*(levels[0],) * 3))
    for y in range(4):
        for x in range(3):
            image.setPixelColor(x, y, QColor(*(levels[1],) * 3))
    assert contrast(image) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    ("bright", "level", "expected"),
    [(0, 0, True), (1, 60, True), (3, 255, False), (4096, 9, False)],
)
def test_what_shows_a_few_bright_pixels_is_not_nearly_black(
    bright: int, level: int, expected: bool
) -> None:
    image = QImage(64, 64, QImage.Format.Format_RGB888)
    image.fill(QColor(0, 0, 0))
    for number in range(bright):
        image.setPixelColor(number % 64, number // 64, QColor(level, level, level))
    assert is_nearly_black(image) == expected
