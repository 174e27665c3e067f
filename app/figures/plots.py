"""Plots as PNG files, drawn off screen."""

from __future__ import annotations

import html
import os
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.figures.picture import save_image, software

COLORS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167))
"""Colours distinguishable with colour blindness (Okabe and Ito)."""


WIDTH = 800
"""Width of plots below one another in pixels."""

INK = "#222"
"""Colour of texts."""

CAPTION_HEIGHT = 60

AXIS_WIDTH = 76
"""Width of an upright axis with its numbers and label, in pixels."""

LETTER_WIDTH = 6.5
"""Of captions, in pixels."""


@dataclass(frozen=True)
class Curve:
    """One line of a plot.

    Attributes
    ----------
    x, y : ndarray, shape (n,)
    labels : tuple of str
        Text beside the points; none by default.
    joined : bool
        Whether a line joins the points.
    """

    name: str
    x: NDArray[np.floating]
    y: NDArray[np.floating]
    labels: tuple[str, ...] = ()
    joined: bool = True


@dataclass(frozen=True)
class Plot:
    """Curves over common axes.

    Attributes
    ----------
    logarithmic : bool
        Whether both axes are logarithmic.
    y_limit : float, optional
        The vertical axis covers plus and minus this value.
    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    logarithmic: bool = False
    y_limit: float | None = None


def save_plots(path: Path, plots: list[Plot], height: int = 360, caption: str = "") -> None:
    """Draw plots below one another into a PNG file, with a caption under them.

    Raises
    ------
    RenderError
        When the file cannot be written.
    """
    layout = new_layout(WIDTH, height * len(plots) + (CAPTION_HEIGHT if caption else 0))
    for row, plot in enumerate(plots):
        add_plot(layout, row, 0, plot)
    add_caption(layout, len(plots), 1, caption, WIDTH)
    save_layout(path, layout, caption)


def add_plot(layout: Any, row: int, column: int, plot: Plot) -> None:
    """Add a plot to a layout."""
    item = layout.addPlot(row=row, col=column)
    item.setTitle(plot.title, color=INK)
    label_axis(item, "bottom", plot.x_label)
    label_axis(item, "left", plot.y_label)
    # pyqtgraph measures the numbers too late for the first picture.
    item.getAxis("left").setWidth(AXIS_WIDTH)
    item.setLogMode(plot.logarithmic, plot.logarithmic)
    item.showGrid(x=True, y=True, alpha=0.3)
    if plot.y_limit is not None:
        item.setYRange(-plot.y_limit, plot.y_limit)
    item.addLegend(labelTextColor="k")
    for curve, color in zip(plot.curves, COLORS, strict=False):
        _draw(item, curve, color, plot.logarithmic)
    if plot.logarithmic:
        # Room for the points' labels.
        item.getViewBox().setDefaultPadding(0.1)
        for axis, values in (
            ("bottom", [curve.x for curve in plot.curves]),
            ("left", [curve.y for curve in plot.curves]),
        ):
            item.getAxis(axis).setTicks([_ticks(np.concatenate(values))])


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
    """Draw a layout into a PNG file, which also has the description as a text.

    Raises
    ------
    RenderError
        When the file cannot be written.
    """
    from PySide6.QtCore import QCoreApplication

    QCoreApplication.processEvents()
    picture = layout.grab().toImage()
    picture.setText("Software", software())
    if description:
        picture.setText("Description", description)
    save_image(path, picture)


def _ticks(values: NDArray[np.floating]) -> list[tuple[float, str]]:
    """Places and names of 1, 2 and 5 times powers of 10, around these values."""
    low, high = (int(np.floor(np.log10(v))) for v in (values.min(), values.max()))
    marks = [m * 10.0**power for power in range(low, high + 2) for m in (1, 2, 5)]
    return [(float(np.log10(mark)), f"{mark:g}") for mark in marks]


def _draw(item: Any, curve: Curve, color: tuple[int, int, int], logarithmic: bool) -> None:
    import pyqtgraph as pg

    symbol = "o" if curve.labels or not curve.joined else None
    item.plot(
        curve.x,
        curve.y,
        pen=pg.mkPen(color, width=2) if curve.joined else None,
        symbol=symbol,
        symbolBrush=color,
        symbolPen=None,
        symbolSize=7,
        name=curve.name,
    )
    for x, y, text in zip(curve.x, curve.y, curve.labels, strict=False):
        label = pg.TextItem(text, color=color, anchor=(0, 1))
        label.setPos(*(np.log10([x, y]) if logarithmic else (x, y)))
        item.addItem(label)
