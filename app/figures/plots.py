"""Figures by pyqtgraph: images, plots of TFs and maps, in layouts and pages with captions."""

from __future__ import annotations

import html
import os
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QCoreApplication
from PySide6.QtWidgets import QGraphicsRectItem

from app.picture import save_image
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.transfer_function import TF_SAMPLES, GaussianMode, Range
from model.scene.value_scale import ValueScale, logarithmic_ticks

COLORS = ((0, 114, 178), (213, 94, 0), (0, 158, 115), (204, 121, 167))
"""Colours distinguishable with colour blindness (Okabe and Ito)."""

INK = "#222"  # colour of texts
CAPTION_HEIGHT = 60

AXIS_WIDTH = 76  # width of an upright axis with its numbers and label, in pixels
LETTER_WIDTH = 6.5  # of captions, in pixels


def label_axis(plot: Any, side: str, text: str) -> None:
    """Label an axis of a plot, "left", "right" or "bottom", with numbers as they are."""
    axis = plot.getAxis(side)
    axis.enableAutoSIPrefix(False)
    axis.setTextPen(INK)
    axis.setLabel(text, color=INK)


OPACITY_COLOR = 0, 114, 178
SENSITIVITY_COLOR = 200, 30, 30
MODE_COLOR = 0, 140, 90
BAND_COLOR = 200, 30, 30, 60

RIGHT_WIDTH = 72  # width of the axis of sensitivities, in pixels
LEFT_WIDTH = 52  # width of the axis of opacities, in pixels
STRIP = 0.07  # height of the strip of the TF's colours below the curve, of the axis
RESPONSES_PER_AXIS = 6  # numbers along the axis of sensitivities, about
ROOM = 1.08  # upper end of the axis


@dataclass(frozen=True, eq=False)
class TFPlot:
    """Content of a plot; arrays are of 256 values, and None is left out."""

    title: str
    scalar_range: Range
    opacity: NDArray[np.floating]
    colors: NDArray[np.floating] | None  # (256, 3) in [0, 1], for a strip below the curve
    value_label: str = "scalar value"
    responses: NDArray[np.floating] | None = None  # red, over the opacities, with an own axis
    response_label: str = "change / +.01"
    window: NDArray[np.bool_] | None = None  # values that determine that axis; all by default
    band: NDArray[np.floating] | None = None  # weights in [0, 1] of values whose field is shown
    mode: GaussianMode | None = None  # that is to be added, dashed
    scale: ValueScale = "linear"

    @classmethod
    def of(cls, title: str, inputs: SceneInputs, units: str = "", **others: Any) -> TFPlot:
        """Return the plot of the TF of scene inputs."""
        scalar_range = inputs.opacity_tf.scalar_range
        return cls(
            title,
            scalar_range,
            inputs.opacity_tf.sample(scalar_range),
            inputs.color_tf.sample(scalar_range),
            f"scalar value{f' ({units})' if units else ''}",
            scale=inputs.opacity_tf.scale,
            **others,
        )


MAP_COLOR = 150, 155, 165, 130
BRUSH_COLOR = COLORS[1]
HOVER_COLOR = 20, 40, 140

Brush = tuple[float, float, float, float]
Disc = tuple[float, float, float]  # a place, and the radius of interpolation or 0

PICTURE = 250  # width and height of a picture with its title, in pixels
PLOT = 400  # width of a plot
MARGIN = 10

CAPTION_SHARE = 0.92  # part of a page's width for captions
SPACING = 6  # pixels between rows and columns


class Page:
    """A figure of columns and rows below a title, in pixels; methods return the added plot."""

    def __init__(self, title: str, widths: list[int], heights: list[int]) -> None:
        if sys.platform == "linux":
            os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
        pg.mkQApp()
        self.title = title
        self._width = sum(widths) + 2 * MARGIN
        self._rows, self._columns = len(heights), len(widths)
        height = sum(heights) + CAPTION_HEIGHT + 30 + 2 * MARGIN
        self.layout = pg.GraphicsLayoutWidget(size=(self._width, height))
        self.layout.setBackground("w")
        self.layout.addLabel(title, 0, 0, 1, len(widths), color=INK, bold=True)
        grid = self.layout.ci.layout
        grid.setSpacing(SPACING)
        grid.setContentsMargins(MARGIN, MARGIN, MARGIN, MARGIN)
        for column, width in enumerate(widths):
            grid.setColumnFixedWidth(column, width - SPACING)
        for row, height in enumerate(heights, start=1):
            grid.setRowFixedHeight(row, height - SPACING)

    def plot(self, row: int, column: int, title: str = "", rows: int = 1, columns: int = 1) -> Any:
        """Add an empty plot."""
        plot = self.layout.addPlot(row=row + 1, col=column, rowspan=rows, colspan=columns)
        if title:
            plot.setTitle(title, color=INK)
        return plot

    def picture(
        self,
        row: int,
        column: int,
        title: str,
        image: NDArray[np.floating],
        region: Region | None = None,
        rows: int = 1,
        columns: int = 1,
    ) -> Any:
        """Add an image (H, W, 3) in [0, 1], with the paper's white rectangle over a region."""
        plot = self.plot(row, column, title, rows, columns)
        plot.hideAxis("left")
        plot.hideAxis("bottom")
        plot.setAspectLocked()
        plot.invertY()
        plot.addItem(_levels(image))
        if region is not None:
            width, height = region.right - region.left, region.bottom - region.top
            item = QGraphicsRectItem(region.left, region.top, width, height)
            item.setPen(pg.mkPen("w", width=2))
            item.setBrush(pg.mkBrush(255, 255, 255, 60))
            plot.addItem(item)
        plot.getViewBox().setDefaultPadding(0.0)
        return plot

    def tf(self, row: int, column: int, content: TFPlot, columns: int = 1) -> Any:
        """Add a plot of a TF."""
        plot = self.plot(row, column, content.title, columns=columns)
        label_axis(plot, "bottom", content.value_label)
        label_axis(plot, "left", "opacity")
        plot.getAxis("left").setTextPen(pg.mkColor(OPACITY_COLOR))
        plot.getAxis("left").setWidth(LEFT_WIDTH)
        # Below 0, where sensitivities may be, there are no opacities.
        plot.getAxis("left").setTicks([[(0, "0"), (0.5, "0.5"), (1, "1")]])
        lo, hi = content.scalar_range
        values = np.linspace(lo, hi, TF_SAMPLES)
        lowest = -STRIP
        if content.band is not None:
            edge = pg.mkPen((*BAND_COLOR[:3], 150), width=1)
            plot.plot(values, content.band, pen=edge, fillLevel=0, brush=pg.mkBrush(*BAND_COLOR))
        if content.responses is not None:
            lowest = _add_responses(plot, values, content)
        plot.plot(values, content.opacity, pen=pg.mkPen(OPACITY_COLOR, width=2))
        if content.mode is not None:
            mode = content.mode
            bump = mode.amplitude * np.exp(-(((values - mode.mean) / mode.width) ** 2))
            pen = pg.mkPen(MODE_COLOR, width=2, style=pg.QtCore.Qt.PenStyle.DashLine)
            shown = np.where(bump < 0.005, np.nan, bump)
            plot.plot(values, shown, pen=pen, connect="finite")
        if content.colors is not None:
            strip = _levels(content.colors[None])
            strip.setRect(lo, lowest - STRIP, hi - lo, STRIP)
            plot.addItem(strip)
        if content.scale == "log":
            ticks = logarithmic_ticks(content.scalar_range)
            plot.getAxis("bottom").setTicks([[(lo + at * (hi - lo), text) for at, text in ticks]])
        plot.setXRange(lo, hi, padding=0)
        plot.setYRange(lowest - STRIP, ROOM, padding=0)
        return plot

    def map(
        self,
        row: int,
        column: int,
        title: str,
        places: NDArray[np.floating],
        brush: Brush | None = None,
        discs: Sequence[Disc] = (),
        rows: int = 1,
        columns: int = 1,
    ) -> Any:
        """Add the map of places (n, 2)."""
        plot = self.plot(row, column, title, rows, columns)
        label_axis(plot, "bottom", "first axis of the map")
        label_axis(plot, "left", "second axis of the map")
        plot.setAspectLocked()
        points = places.astype(np.float64).T
        plot.addItem(pg.ScatterPlotItem(*points, size=3, pen=None, brush=pg.mkBrush(*MAP_COLOR)))
        for number, disc in enumerate(discs, start=1):
            x, y, radius = disc
            cross = {"size": 16, "symbol": "+", "pen": pg.mkPen(HOVER_COLOR, width=2)}
            item = _blob(disc) if radius else pg.ScatterPlotItem([x], [y], **cross)
            item.setZValue(5)
            plot.addItem(item)
            if len(discs) > 1:
                text = pg.TextItem(str(number), color=HOVER_COLOR, anchor=(0.5, 1.6))
                text.setPos(x, y)
                plot.addItem(text)
        if brush is not None:
            pen = pg.mkPen(BRUSH_COLOR, width=2)
            left, lower, right, upper = brush
            for share in np.linspace(0, 1, 5):
                line = left + share * (right - left), lower + share * (upper - lower)
                plot.plot([line[0]] * 2, [lower, upper], pen=pen)
                plot.plot([left, right], [line[1]] * 2, pen=pen)
        return plot

    def bar(
        self,
        row: int,
        column: int,
        colors: NDArray[np.floating],
        ends: tuple[float, float],
        label: str,
    ) -> Any:
        """Add a colour bar of colours (n, 3) from the lower to the higher end of a scale."""
        low, high = ends
        plot, item = self.plot(row, column), _levels(colors[:, None])
        item.setRect(0, low, 1, high - low)
        plot.addItem(item)
        plot.setXRange(0, 1, padding=0)
        plot.setYRange(low, high, padding=0)
        plot.hideAxis("bottom")
        plot.hideAxis("left")
        plot.showAxis("right")
        label_axis(plot, "right", label)
        plot.getAxis("right").setWidth(AXIS_WIDTH)
        return plot

    def text(self, row: int, column: int, text: str, columns: int = 1) -> None:
        """Add a text; lines are parted by <br>."""
        self.layout.addLabel(text, row + 1, column, 1, columns, color=INK)

    def save(self, path: Path, caption: str = "") -> None:
        """Add a caption below, and write the page as a PNG file, which has it as a text, too."""
        lines = textwrap.wrap(caption, int(CAPTION_SHARE * self._width / LETTER_WIDTH))
        if lines:
            self.text(self._rows, 0, "<br>".join(map(html.escape, lines)), self._columns)
        QCoreApplication.processEvents()
        picture = self.layout.grab().toImage()
        picture.setText("Description", f"{self.title}. {caption}" if caption else self.title)
        save_image(path, picture)


def _levels(colors: NDArray[np.floating]) -> Any:
    """Return colours (H, W, 3) in [0, 1] as an item of a plot."""
    levels = np.rint(255 * np.clip(colors, 0, 1)).astype(np.uint8)
    return pg.ImageItem(levels, axisOrder="row-major", levels=(0, 255))


def _add_responses(plot: Any, values: NDArray[np.floating], content: TFPlot) -> float:
    """Draw the sensitivity, scaled to the axis of opacities, and return its lowest point."""
    assert content.responses is not None
    responses = np.asarray(content.responses, dtype=np.float64)
    counted = responses if content.window is None else responses[content.window]
    largest = float(np.abs(counted).max(initial=0)) or 1.0
    shown = np.clip(responses / largest, -ROOM, ROOM)
    if content.window is not None:
        # Values of the background may react a hundred times as much.
        shown = np.where(np.abs(responses) > ROOM * largest, np.nan, shown)
    lowest = min(-STRIP, float(np.nanmin(shown)))
    pen = pg.mkPen(SENSITIVITY_COLOR, width=2)
    plot.plot(values, shown, pen=pen, connect="finite")
    plot.addLine(y=0, pen=pg.mkPen((120, 120, 120), width=1))
    plot.showAxis("right")
    label_axis(plot, "right", content.response_label)
    axis = plot.getAxis("right")
    axis.setTextPen(pg.mkColor(SENSITIVITY_COLOR))
    axis.setWidth(RIGHT_WIDTH)
    least = (1 - lowest) * largest / RESPONSES_PER_AXIS
    power = 10.0 ** np.floor(np.log10(least))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= least * (1 - 1e-9))
    marks = np.arange(np.ceil(lowest * largest / step), np.floor(largest / step) + 1) * step
    axis.setTicks([[(mark / largest, f"{mark + 0.0:.3g}") for mark in marks]])
    return lowest


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


def _blob(disc: Disc) -> Any:
    """Return the Gaussian weights of a disc as an image item."""
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
    return item
