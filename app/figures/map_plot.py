"""A plot of the latent map: samples, a brushed grid, and the Gaussian of the place hovered over."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.figures.plots import COLORS, INK, label_axis

MAP_COLOR = 150, 155, 165, 130
BRUSH_COLOR = COLORS[1]
HOVER_COLOR = 20, 40, 140

Brush = tuple[float, float, float, float]
Disc = tuple[float, float, float]
"""A place and the radius of the disc around it that codes are interpolated over, or 0."""


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
    """Add the map of places (n, 2) to a layout, and return its plot.

    The weights of the interpolation, a Gaussian of a third of the disc's radius, are a dark blue
    blob, as in the paper.
    """
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
    """Return a cross at a place."""
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
