"""Pages of figures: pictures, maps and plots in rows and columns, with a title and a caption."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.figures.plots import (
    CAPTION_HEIGHT,
    COLORS,
    INK,
    TFPlot,
    add_caption,
    add_image,
    add_tf_plot,
    label_axis,
    new_layout,
    save_layout,
)
from model.scene.region import Region

PICTURE = 250  # width and height of a picture with its title, in pixels
PLOT = 400  # width of a plot
MARGIN = 10

CAPTION_SHARE = 0.92  # part of a page's width that captions have: some of their letters are wide
SPACING = 6  # pixels between rows and columns


class Page:
    """A figure of columns and rows below a title, with these widths and heights in pixels."""

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


GAP = 4  # pixels between pictures
EMPTY = 0.12  # grey of gaps and missing pictures


def mosaic(images: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return images (rows, columns, H, W, 3) in [0, 1] as one (H', W', 3); NaN stays empty."""
    rows, columns, height, width, _ = images.shape
    whole = (rows * (height + GAP) - GAP, columns * (width + GAP) - GAP, 3)
    picture = np.full(whole, EMPTY, dtype=np.float32)
    for row, column in np.ndindex(rows, columns):
        y, x = row * (height + GAP), column * (width + GAP)
        image = images[row, column]
        if not np.isnan(image).any():
            picture[y : y + height, x : x + width] = image
    return picture


MAP_COLOR = 150, 155, 165, 130
BRUSH_COLOR = COLORS[1]
HOVER_COLOR = 20, 40, 140

Brush = tuple[float, float, float, float]
Disc = tuple[float, float, float]  # a place, and the radius of interpolation or 0


def add_map(
    layout: Any,
    row: int,
    column: int,
    title: str,
    places: NDArray[np.floating],
    brush: Brush | None = None,
    discs: Sequence[Disc] = (),
    rows: int = 1,
    columns: int = 1,
) -> Any:
    """Add the map of places (n, 2) to a layout, and return its plot."""
    import pyqtgraph as pg

    plot = layout.addPlot(row=row, col=column, rowspan=rows, colspan=columns)
    plot.setTitle(title, color=INK)
    label_axis(plot, "bottom", "first axis of the map")
    label_axis(plot, "left", "second axis of the map")
    plot.setAspectLocked()
    x, y = places.astype(np.float64).T
    plot.addItem(pg.ScatterPlotItem(x, y, size=3, pen=None, brush=pg.mkBrush(*MAP_COLOR)))
    for disc in discs:
        plot.addItem(_blob(disc) if disc[2] else _cross(disc))
    if brush is not None:
        pen = pg.mkPen(BRUSH_COLOR, width=2)
        left, lower, right, upper = brush
        for share in np.linspace(0, 1, 5):
            line = left + share * (right - left), lower + share * (upper - lower)
            plot.plot([line[0]] * 2, [lower, upper], pen=pen)
            plot.plot([left, right], [line[1]] * 2, pen=pen)
    for number, (px, py, _) in enumerate(discs, start=1):
        if len(discs) > 1:
            text = pg.TextItem(str(number), color=HOVER_COLOR, anchor=(0.5, 1.6))
            text.setPos(px, py)
            plot.addItem(text)
    return plot


def _cross(disc: Disc) -> Any:
    import pyqtgraph as pg

    x, y, _ = disc
    item = pg.ScatterPlotItem([x], [y], size=16, symbol="+", pen=pg.mkPen(HOVER_COLOR, width=2))
    item.setZValue(5)
    return item


def _blob(disc: Disc) -> Any:
    """Return the Gaussian weights of a disc as an image item."""
    import pyqtgraph as pg

    x, y, radius = disc
    side = np.linspace(-1, 1, 65)
    squares = side[:, None] ** 2 + side**2
    # exp(-d^2 / h^2) with h a third of the radius; nothing beyond the disc counts.
    weights = np.where(squares <= 1, np.exp(-9 * squares), 0)
    blob = np.zeros((65, 65, 4), dtype=np.uint8)
    blob[..., :3] = HOVER_COLOR
    blob[..., 3] = np.rint(235 * weights)
    item = pg.ImageItem(blob, axisOrder="row-major", levels=(0, 255))
    item.setRect(x - radius, y - radius, 2 * radius, 2 * radius)
    item.setZValue(5)
    return item
