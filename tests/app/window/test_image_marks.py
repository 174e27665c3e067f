from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from PySide6.QtCore import QRect
from PySide6.QtGui import QColor, QImage, QPainter
from ramp import make_tf

from app.window.image_marks import paint_legend


def painted(size: int, background: str = "#000000", units: str = "K") -> NDArray[np.uint8]:
    """Paint a legend over a plain square; return its pixels (size, size, 3)."""
    image = QImage(size, size, QImage.Format.Format_RGB888)
    image.fill(QColor(background))
    painter = QPainter(image)
    color = QColor(background)
    behind = (color.red(), color.green(), color.blue())
    paint_legend(painter, QRect(0, 0, size, size), make_tf(), units, behind)
    painter.end()
    stored = np.frombuffer(image.constBits(), np.uint8).reshape(size, image.bytesPerLine())
    return stored[:, : 3 * size].reshape(size, size, 3).copy()


@pytest.mark.usefixtures("qapp")
@pytest.mark.parametrize("background", ["#000000", "#ffffff", "#808080"])
def test_it_stands_out_and_leaves_most_of_the_image_free(background: str) -> None:
    pixels = painted(400, background).astype(int)
    level = int(background[1:3], 16)
    changed = np.abs(pixels - level).max(axis=-1) > 90
    rows, columns = np.nonzero(changed)
    assert columns.min() > 200 and columns.max() < 399
    assert rows.min() > 150 and rows.max() < 399
    assert 0.005 < changed.mean() < 0.1


@pytest.mark.usefixtures("qapp")
def test_the_strip_has_the_tfs_colors_from_bottom_to_top() -> None:
    pixels = painted(800).astype(float)
    expected = 255 * make_tf().color.sample(count=11)
    # Wherever the strip is, it is 0.4 of the height long.
    tops = np.arange(300, 480)
    rows = tops[:, None] + np.linspace(319, 0, 11).round().astype(int)
    errors = np.abs(pixels[rows, 600:] - expected[None, :, None])[:, 1:-1].mean(axis=(1, 3))
    assert errors.min() < 8


@pytest.mark.usefixtures("qapp")
def test_units_are_written_and_tiny_images_stay_free() -> None:
    assert (painted(400, units="K") != painted(400, units="")).any()
    assert not painted(100).any()
