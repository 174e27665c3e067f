"""Plots as PNG files, drawn off screen."""

from __future__ import annotations

import html
import os
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.figures.picture import save_image, software

COLORS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167))
"""Colours distinguishable with colour blindness (Okabe and Ito)."""


INK = "#222"
"""Colour of texts."""

CAPTION_HEIGHT = 60

AXIS_WIDTH = 76
"""Width of an upright axis with its numbers and label, in pixels."""

LETTER_WIDTH = 6.5
"""Of captions, in pixels."""


def new_layout(width: int, height: int) -> Any:
    """Return an empty white layout of plots, off screen, of a size in pixels."""
    if sys.platform == "linux":
        os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    import pyqtgraph as pg

    pg.mkQApp()
    layout = pg.GraphicsLayoutWidget(size=(width, height))
    layout.setBackground("w")
    return layout


def label_axis(plot: Any, side: str, text: str) -> None:
    """Label an axis of a plot, "left", "right" or "bottom", with numbers as they are."""
    axis = plot.getAxis(side)
    axis.enableAutoSIPrefix(False)
    axis.setTextPen(INK)
    axis.setLabel(text, color=INK)


def add_caption(layout: Any, row: int, columns: int, text: str, width: int) -> None:
    """Add a text below the plots of a layout of a width in pixels, in as many lines as it takes."""
    if text:
        lines = textwrap.wrap(text, int(width / LETTER_WIDTH))
        layout.addLabel("<br>".join(map(html.escape, lines)), row, 0, 1, columns, color=INK)


def add_image(
    layout: Any, row: int, column: int, title: str, image: NDArray[np.floating], rows: int = 1
) -> Any:
    """Add an image (H, W, 3) in [0, 1] to a layout, row 0 at the top, and return its plot."""
    import pyqtgraph as pg

    plot = layout.addPlot(row=row, col=column, rowspan=rows)
    plot.setTitle(title, color=INK)
    plot.hideAxis("left")
    plot.hideAxis("bottom")
    plot.setAspectLocked()
    plot.invertY()
    levels = np.rint(255 * np.clip(image, 0, 1)).astype(np.uint8)
    plot.addItem(pg.ImageItem(levels, axisOrder="row-major", levels=(0, 255)))
    return plot


def save_layout(path: Path, layout: Any, description: str = "") -> None:
    """Draw a layout into a PNG file, which also has the description as a text."""
    from PySide6.QtCore import QCoreApplication

    QCoreApplication.processEvents()
    picture = layout.grab().toImage()
    picture.setText("Software", software())
    if description:
        picture.setText("Description", description)
    save_image(path, picture)
