"""Curves and areas in the plots, and the volume's histogram behind them."""

from typing import Any

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QBrush, QPainter, QPainterPath, QPen
from PySide6.QtWidgets import QGraphicsItem, QStyleOptionGraphicsItem, QWidget

from app.controls import Painted
from app.number_box import significant
from app.tf_editor.unit_axis import ScalarAxis
from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale, values_at

_BEYOND = 0.015  # part of the plot by which outermost bins reach beyond it
_WIDEST_GAP = 8  # largest distance, in bins, between two teeth of a comb
_COMB = 0.1  # least share of empty bins in narrow gaps that makes a histogram a comb
_OVERHANG = 0.05  # margin of a pen beyond its curve, in widths of a plot and own heights
_STRAIGHT = 1e-11  # bend of a line below which a point is dropped, as a share of its height


class Curve(QGraphicsItem):
    """A line in a plot, with the area below it if it has a brush; much faster than pyqtgraph's."""

    pen = Painted(QPen(Qt.PenStyle.NoPen))
    brush = Painted(QBrush())

    def __init__(self, plot: Any) -> None:
        super().__init__()
        plot.addItem(self, ignoreBounds=True)
        self.places: NDArray[np.floating] = np.empty(0)
        self.heights: NDArray[np.floating] = np.empty(0)
        self._line, self._area, self._box = QPainterPath(), QPainterPath(), QRectF()

    def draw(self, places: NDArray[np.floating], heights: NDArray[np.floating]) -> None:
        """Draw another line."""
        self.prepareGeometryChange()
        self.places, self.heights = places, heights
        run, rise, highest = np.diff(places), np.diff(heights), np.max(heights, initial=0.0)
        bends = np.abs(run[1:] * rise[:-1] - run[:-1] * rise[1:]) > _STRAIGHT * highest
        kept = np.ones(len(places), bool)
        # The fewer points, the faster a wide line is drawn.
        kept[1:-1] = bends
        self._line = pg.arrayToQPath(places[kept], heights[kept])
        self._area = QPainterPath(self._line)
        if len(places):
            self._area.lineTo(places[-1], 0.0)
            self._area.lineTo(places[0], 0.0)
        box = self._area.controlPointRect()
        over = _OVERHANG * (1.0 + box.height())
        self._box = box.adjusted(-_OVERHANG, -over, _OVERHANG, over)
        # Painted from a cache, it would keep its shape if the box is the same.
        self.update()

    def boundingRect(self) -> QRectF:
        """Return the area that is painted."""
        return self._box

    def shape(self) -> QPainterPath:
        """Return an empty area, so that the curve takes no mouse events."""
        return QPainterPath()

    def paint(
        self, painter: QPainter, _option: QStyleOptionGraphicsItem, _widget: QWidget | None = None
    ) -> None:
        """Draw the area, and then the line."""
        if self.brush.style() != Qt.BrushStyle.NoBrush:
            painter.fillPath(self._area, self.brush)
        if self.pen.style() != Qt.PenStyle.NoPen:
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.strokePath(self._line, self.pen)


class HistogramLayer:
    """Draws numbers of voxels, logarithmically, in a plot with heights from 0 to 1."""

    def __init__(self, view: Any) -> None:
        self.curve = Curve(view)
        self.curve.setZValue(-10)
        self.curve.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)
        self.counts: NDArray[np.int64] = np.zeros(1, dtype=np.int64)
        self.edges: NDArray[np.float64] = np.array([0.0, 1.0])
        self._drawn: NDArray[np.float64] = np.zeros(1)

    def text_at(self, value: float, scale: ValueScale) -> str:
        """Return the drawn number of voxels in a value's bin, in words; empty outside all bins."""
        index = int(np.searchsorted(self.edges, value, side="right")) - 1
        if not 0 <= index < len(self.counts):
            return ""
        ends = (significant(each, 5) for each in values_at(self.edges[index : index + 2], scale))
        count = round(float(self._drawn[index]))
        about = "about " * (count != int(self.counts[index]))
        return f"{about}{count:,} voxel{'s' * (count != 1)} from {' to '.join(ends)}"

    def set_data(self, counts: NDArray[np.int64], edges: NDArray[np.float64]) -> None:
        """Take another volume's histogram; :meth:`draw` shows it."""
        self.counts = np.asarray(counts, dtype=np.int64)
        self.edges = np.asarray(edges, dtype=np.float64)
        self._drawn = without_comb(self.counts)

    def draw(self, axis: ScalarAxis) -> None:
        """Draw the part that an axis shows."""
        places = axis.places(self.edges).clip(-_BEYOND, 1.0 + _BEYOND)
        shown = np.diff(places) > 0
        if not shown.any():
            self.curve.draw(np.empty(0), np.empty(0))
            return
        first, last = np.flatnonzero(shown)[[0, -1]]
        heights = np.log1p(self._drawn) / max(np.log1p(self._drawn.max()), 1.0)
        ends = np.repeat(places[first : last + 2], 2)[1:-1]
        self.curve.draw(ends, np.repeat(heights[first : last + 1], 2))


def without_comb(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Close the gaps of a histogram that is a comb; other counts (bins,) stay.

    Data stretched to a wider range skip some whole numbers. Each tooth is spread over half of the
    gaps next to it, so that the shape is visible.
    """
    teeth = np.flatnonzero(counts)
    gaps = np.diff(teeth)
    narrow = gaps <= _WIDEST_GAP
    if (gaps[narrow] - 1).sum() < _COMB * len(counts):
        return counts.astype(np.float64)
    # Bins beyond a wide gap do not belong to the comb, and keep their heights.
    gaps = np.where(narrow, gaps, 1)
    shares = (np.concatenate([[1], gaps]) + np.concatenate([gaps, [1]])) / 2
    drawn = np.interp(np.arange(len(counts)), teeth, counts[teeth] / shares, left=0.0, right=0.0)
    for first, last in zip(teeth[:-1][~narrow], teeth[1:][~narrow], strict=True):
        drawn[first + 1 : last] = 0.0
    return drawn


def percentile_range(
    counts: NDArray[np.int64], edges: NDArray[np.float64], lower: float, upper: float
) -> Range:
    """Return the values between two percentiles, in percent, of a histogram.

    They are the lower edge of the lower percentile's bin and the upper edge of the upper one's,
    because nothing is known within a bin.
    """
    shares = np.cumsum(counts) / max(int(counts.sum()), 1)
    first = int(np.searchsorted(shares, lower / 100, side="right"))
    last = int(np.searchsorted(shares, upper / 100 - 1e-12))
    first, last = min(first, len(counts) - 1), min(last, len(counts) - 1)
    return float(edges[min(first, last)]), float(edges[last + 1])
