"""Opacity images in the window, on fake engines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from fake_models import make_model
from PySide6.QtGui import QAction, QImage
from window_fakes import FakeBuilders

from app.window.main_window import MainWindow
from model.rendering.scale_bar import Scale

WindowMaker = Callable[..., MainWindow]


def action(window: MainWindow, keys: str) -> QAction:
    (found,) = [a for a in window.findChildren(QAction) if a.shortcut().toString() == keys]
    return found


def grays(picture: QImage | None) -> set[int]:
    assert picture is not None
    pixels = ((x, y) for x in range(picture.width()) for y in range(picture.height()))
    return {picture.pixelColor(x, y).value() for x, y in pixels}


def test_opacity_images_lie_in_the_corner_above_the_scale_bar_and_below_fields(
    make_window: WindowMaker, builders: FakeBuilders, tmp_path: Path
) -> None:
    builders.draws_codes = True
    figures = {"holdout": {"rmse": 0.08, "emd": 0.02}, "kinds": {"step": {"rmse": 0.1}}}
    window = make_window(model=make_model(tmp_path / "model", metrics=figures))
    opacity = action(window, "O")
    generator, reference = window.overlays.insets
    assert not opacity.isChecked() and generator.picture is None
    before = window.generator.canvas.grab().toImage()
    opacity.trigger()
    assert opacity.isChecked() and window.overlays.has_opacity
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
    overlays, canvas = window.overlays, window.reference.canvas
    overlays.toggle_opacity()
    if overlays.has_scale_bar:
        overlays.toggle_scale_bar()
    without = canvas.grab().toImage()
    overlays.subject = replace(
        overlays.subject, scale=Scale((0.6, 0.6, 0.5), 50.0, "mm", (0.0,) * 3, (1.0,) * 3)
    )
    overlays.toggle_scale_bar()
    image = canvas.grab().toImage()
    places = ((x, y) for x in range(image.width()) for y in range(image.height()))
    changed = [(x, y) for x, y in places if image.pixel(x, y) != without.pixel(x, y)]
    box = overlays.insets[1].box
    assert changed and min(y for _, y in changed) > box.bottom()
    black = QImage(8, 8, QImage.Format.Format_RGB888)
    black.fill(0)
    canvas.show_cover(black)
    square = canvas.picture_rect
    assert canvas.grab().toImage().pixelColor(square.left() + 40, square.bottom() - 60).value() < 50
    assert window.generator.title == "Paper's networks"
    tip = window.generator.caption.toolTip()
    assert "RMSE 0.080, colour EMD 0.020; by kind of TF: steps 0.100." in tip
    window.workspace.open_model(None)
    assert window.generator.title == "Generator"
