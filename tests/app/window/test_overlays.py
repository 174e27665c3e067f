"""Opacity images in the window, on fake engines."""

from __future__ import annotations

import numpy as np
from PySide6.QtGui import QAction, QImage

from app.window.main_window import MainWindow


def action(window: MainWindow, keys: str) -> QAction:
    (found,) = [a for a in window.findChildren(QAction) if a.shortcut().toString() == keys]
    return found


def grays(picture: QImage | None) -> set[int]:
    assert picture is not None
    pixels = ((x, y) for x in range(picture.width()) for y in range(picture.height()))
    return {picture.pixelColor(x, y).value() for x, y in pixels}


def test_opacity_images_lie_in_the_corner(make_window, builders):
    builders.draws_codes = True
    window = make_window()
    opacity = action(window, "O")
    generator, reference = window.overlays.insets
    assert not opacity.isChecked() and generator.picture is None
    before = window.generator.canvas.grab().toImage()
    opacity.trigger()
    assert opacity.isChecked() and window.overlays.has("opacity_images")
    # The fakes' images are opaque everywhere.
    assert grays(generator.picture) == grays(reference.picture) == {255}
    square = window.generator.canvas.picture_rect
    at = square.left() + 40, square.bottom() - 60
    shown = window.generator.canvas.grab().toImage()
    assert before.pixelColor(*at).lightness() < 100 < 250 < shown.pixelColor(*at).lightness()
    # Another image brings its own.
    rgba = np.full((16, 16, 4), 0.5, np.float32)
    rgba[..., 3] = 0.2
    window.generator.imageShown.emit(window.state.inputs, rgba)
    assert grays(generator.picture) == {51}
    opacity.trigger()
    assert generator.picture is None
    assert window.generator.canvas.grab().toImage().pixelColor(*at) == before.pixelColor(*at)


def test_a_background_lies_behind_the_images_and_behind_a_figure(make_window):
    window = make_window()
    pane, rgba = window.reference, np.zeros((16, 16, 4), np.float32)
    # The left half is empty, the right half is opaque and red.
    rgba[:, 8:] = (1.0, 0.0, 0.0, 1.0)
    (black,) = [a for a in window.findChildren(QAction) if a.text() == "Black"]
    assert black.isChecked() and pane.canvas.background == (0, 0, 0)
    found = {}
    for name in ("White", "Gradient"):
        (choice,) = [a for a in window.findChildren(QAction) if a.text() == name]
        choice.trigger()
        assert choice.isChecked()
        pane.canvas.replace_image(pane._picture(rgba))
        rect, shown = pane.canvas.picture_rect, pane.canvas.grab().toImage()
        xs = rect.left() + rect.width() // 4, rect.left() + 3 * rect.width() // 4
        ys = rect.top() + rect.height() // 3, rect.top() + 3 * rect.height() // 4
        assert all(shown.pixelColor(xs[1], y).getRgb()[:3] == (255, 0, 0) for y in ys)
        found[name] = [shown.pixelColor(xs[0], y).value() for y in ys]
        assert window.saving.first_choice().background == pane.canvas.background
    assert found["White"] == [255, 255]
    assert 20 < found["Gradient"][1] < found["Gradient"][0] < 130
