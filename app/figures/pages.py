"""Pages of figures: pictures and plots in rows and columns, with a title and a caption."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.figures.plots import CAPTION_HEIGHT, INK, add_caption, add_image, new_layout, save_layout
from app.figures.tf_plot import TFPlot, add_tf_plot
from model.scene.region import Region

PICTURE = 250
"""Width and height of a picture with its title, in pixels."""

PLOT = 400
"""Width of a plot."""

MARGIN = 10

CAPTION_SHARE = 0.92
"""Part of a page's width that captions have: some of their letters are wide."""

SPACING = 6
"""Pixels between rows and columns."""


class Page:
    """A figure under way.

    Parameters
    ----------
    widths : sequence of int
        Of the columns, in pixels.
    heights : sequence of int
        Of the rows below the title.
    """

    def __init__(self, title: str, widths: list[int], heights: list[int]) -> None:
        self.title = title
        self._width = sum(widths) + 2 * MARGIN
        self._rows, self._columns = len(heights), len(widths)
        self.layout = new_layout(self._width, sum(heights) + CAPTION_HEIGHT + 30 + 2 * MARGIN)
        self.layout.addLabel(title, 0, 0, 1, len(widths), color=INK, bold=True)
        grid = self.layout.ci.layout
        grid.setSpacing(SPACING)
        grid.setContentsMargins(MARGIN, MARGIN, MARGIN, MARGIN)
        for column, width in enumerate(widths):
            grid.setColumnFixedWidth(column, width - SPACING)
        for row, height in enumerate(heights, start=1):
            grid.setRowFixedHeight(row, height - SPACING)

    def picture(
        self,
        row: int,
        column: int,
        title: str,
        image: NDArray[np.floating],
        region: Region | None = None,
        rows: int = 1,
    ) -> Any:
        """Add an image (H, W, 3), with the paper's white rectangle over a region."""
        plot = add_image(self.layout, row + 1, column, title, image, rows)
        if region is not None:
            add_rectangle(plot, region)
        plot.getViewBox().setDefaultPadding(0.0)
        return plot

    def tf(self, row: int, column: int, content: TFPlot, rows: int = 1) -> Any:
        """Add a plot of a TF."""
        return add_tf_plot(self.layout, row + 1, column, content, rows)

    def text(self, row: int, column: int, text: str, columns: int = 1) -> None:
        """Add a text; lines are parted by <br>."""
        self.layout.addLabel(text, row + 1, column, 1, columns, color=INK)

    def save(self, path: Path, caption: str) -> None:
        """Add a caption below, and write the page as a PNG file."""
        width = int(CAPTION_SHARE * self._width)
        add_caption(self.layout, self._rows + 1, self._columns, caption, width)
        save_layout(path, self.layout, f"{self.title}. {caption}")


def add_rectangle(plot: Any, region: Region) -> None:
    """Draw a slightly transparent white rectangle over an image, as the paper does."""
    import pyqtgraph as pg
    from PySide6.QtWidgets import QGraphicsRectItem

    width, height = region.right - region.left, region.bottom - region.top
    item = QGraphicsRectItem(region.left, region.top, width, height)
    item.setPen(pg.mkPen("w", width=2))
    item.setBrush(pg.mkBrush(255, 255, 255, 60))
    plot.addItem(item)
