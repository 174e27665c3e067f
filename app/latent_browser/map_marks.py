"""Points of the map with their colours, and marks over them: brush, present TF, legend."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPen

from app import theme
from app.latent_browser.map_frame import MapFrame
from app.short_numbers import significant
from app.state.latent_state import Place
from model.latent.latent_map import CELLS, Brush
from model.scene.value_scale import values_at

if TYPE_CHECKING:
    from app.state.latent_session import LatentSession

BRUSH = "#f0f0f0"
PRESENT = theme.ON_IMAGE.attention
HANDLE = 4.0
RADIUS = 2
"""Radius of a point at a zoom of 1, in pixels; closer points are larger."""
LEGEND_WIDTH, LEGEND_HEIGHT, MARGIN = 84, 6, 10

HIDDEN = (45, 46, 49)
"""Colour of points that are filtered out."""

NOTHING = (64, 66, 70)
"""Colour of TFs that show nothing or a solid block, and of all until that is known."""


@dataclass(frozen=True, eq=False)
class Shades:
    """Colours (n, 3) of the map's points, their order, and the texts at the colour bar's ends."""

    colors: NDArray[np.uint8]
    order: NDArray[np.int64]
    low: str
    high: str


def shades_of(session: LatentSession, units: str) -> Shades:
    """Colour the points of a session's map by the value that each TF shows most."""
    map_, overview, space = session.map, session.overview, session.space
    assert map_ is not None and space is not None
    count, frame, table = len(map_.codes), space.frame, lookup_table()
    colors = np.tile(np.array(NOTHING, np.uint8), (count, 1))
    shown = np.zeros(count, dtype=bool)
    low, high = frame.window
    if overview is not None:
        shown = overview.shows_something
        values = overview.dominant_values(frame.scalar_range)[shown]
        share = np.clip((values - low) / (high - low), 0, 1)
        colors[shown] = table[(share * (len(table) - 1)).astype(np.int64)]
    wanted = np.ones(count, dtype=bool) if session.wanted is None else session.wanted
    colors[~wanted] = HIDDEN
    order = np.lexsort((np.arange(count), 2 * wanted + shown))
    first, last = (significant(float(end), digits=3) for end in values_at((low, high), frame.scale))
    return Shades(colors, order, f"Value {first}", f"{last} {units}".strip())


@cache
def lookup_table() -> NDArray[np.uint8]:
    """Colours (256, 3) of the map, perceptually uniform."""
    table = pg.colormap.get("viridis").getLookupTable(0.12, 1.0, 256)
    return np.asarray(table[:, :3], dtype=np.uint8)


def draw_points(
    pixels: NDArray[np.float64], colors: NDArray[np.uint8], size: tuple[int, int], radius: float
) -> QImage:
    """Paint points as soft discs; later ones lie above earlier ones.

    Ten thousand points take a few milliseconds, and moving the mouse over the map then costs
    one picture.
    """
    width, height = size
    border = int(np.ceil(radius)) + 1
    canvas = np.zeros((height + 2 * border, width + 2 * border, 4), dtype=np.uint8)
    inside = ((pixels >= -border + 1) & (pixels < (width + border - 1, height + border - 1))).all(
        axis=1
    )
    x, y = (np.floor(pixels[inside]).astype(np.int64) + border).T
    colors = colors[inside]
    reach = range(-border, border + 1)
    steps = [(dx, dy, float(np.hypot(dx, dy))) for dx in reach for dy in reach]
    # The rims first, so that no rim covers another point's disc.
    for dx, dy, distance in sorted(steps, key=lambda step: -step[2]):
        coverage = min(max(radius + 0.5 - distance, 0.0), 1.0)
        if coverage:
            column = np.clip(x + dx, 0, canvas.shape[1] - 1)
            row = np.clip(y + dy, 0, canvas.shape[0] - 1)
            canvas[row, column, :3] = colors * coverage
            canvas[row, column, 3] = 255 * coverage
    shown = np.ascontiguousarray(canvas[border:-border, border:-border])
    format_ = QImage.Format.Format_RGBA8888_Premultiplied
    return QImage(shown.data, width, height, 4 * width, format_).copy()


def paint_brush(painter: QPainter, frame: MapFrame, brush: Brush, active: int | None) -> None:
    """Paint the rectangle with its 4 x 4 cells, one of them marked."""
    rect = frame.rectangle(brush)
    thin = QColor(BRUSH)
    thin.setAlpha(70)
    painter.setPen(QPen(thin, 1))
    for i in range(1, CELLS):
        x = rect.left() + rect.width() * i / CELLS
        y = rect.top() + rect.height() * i / CELLS
        painter.drawLine(QPointF(x, rect.top()), QPointF(x, rect.bottom()))
        painter.drawLine(QPointF(rect.left(), y), QPointF(rect.right(), y))
    painter.setPen(QPen(QColor(BRUSH), 1.3))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawRect(rect)
    if active is not None:
        row, column = divmod(active, CELLS)
        width, height = rect.width() / CELLS, rect.height() / CELLS
        cell = QRectF(rect.left() + column * width, rect.top() + row * height, width, height)
        painter.setPen(QPen(QColor(theme.ON_IMAGE.change), 2))
        painter.drawRect(cell)
    painter.setPen(QPen(QColor(theme.ON_IMAGE.window), 1))
    painter.setBrush(QColor(BRUSH))
    for corner in (rect.topLeft(), rect.topRight(), rect.bottomLeft(), rect.bottomRight()):
        painter.drawRect(QRectF(corner.x() - HANDLE, corner.y() - HANDLE, 2 * HANDLE, 2 * HANDLE))


def paint_disc(painter: QPainter, frame: MapFrame, place: Place, radius: float) -> None:
    """Paint the disc that a place under the mouse is interpolated over."""
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QPen(QColor(theme.ON_IMAGE.change), 1.5))
    r = radius * frame.scale
    painter.drawEllipse(frame.pixel(place), r, r)


def paint_present(painter: QPainter, frame: MapFrame, place: Place) -> None:
    """Mark the present TF's place by a ring with a cross."""
    at = frame.pixel(place)
    for color, width in ((theme.ON_IMAGE.window, 4.5), (PRESENT, 2)):
        painter.setPen(QPen(QColor(color), width))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(at, 7, 7)
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            painter.drawLine(at + QPointF(7 * dx, 7 * dy), at + QPointF(11 * dx, 11 * dy))


def paint_different(painter: QPainter, frame: MapFrame, places: NDArray[np.floating]) -> None:
    """Mark the samples that show the most different things, by squares."""
    for color, width in ((theme.ON_IMAGE.window, 3.5), (BRUSH, 1.5)):
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(color), width))
        for x, y in frame.pixels(places).tolist():
            painter.drawRect(QRectF(x - 4, y - 4, 8, 8))


def paint_note(painter: QPainter, frame: MapFrame, text: str) -> None:
    """Paint a few words in the lower right corner."""
    metrics = QFontMetricsF(painter.font())
    width = metrics.horizontalAdvance(text)
    left, top = frame.width - MARGIN - width, frame.height - MARGIN - metrics.height()
    _paint_ground(painter, QRectF(left - 4, top - 3, width + 8, metrics.height() + 6))
    painter.setPen(QColor(theme.ON_IMAGE.dim))
    painter.drawText(QPointF(left, top + metrics.ascent()), text)


def _paint_ground(painter: QPainter, box: QRectF) -> None:
    ground = QColor(theme.ON_IMAGE.window)
    ground.setAlpha(200)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(ground)
    painter.drawRoundedRect(box, 4, 4)


def paint_legend(painter: QPainter, frame: MapFrame, shades: Shades) -> None:
    """Paint the colour bar between its numbers in the lower left corner."""
    metrics = QFontMetricsF(painter.font())
    low, high = (metrics.horizontalAdvance(text) + 6 for text in (shades.low, shades.high))
    top = frame.height - MARGIN - metrics.height()
    width = low + LEGEND_WIDTH + high
    _paint_ground(painter, QRectF(MARGIN - 4, top - 3, width + 8, metrics.height() + 6))
    table = lookup_table()
    bar = QImage(table.tobytes(), len(table), 1, 3 * len(table), QImage.Format.Format_RGB888)
    middle = top + (metrics.height() - LEGEND_HEIGHT) / 2
    painter.drawImage(QRectF(MARGIN + low, middle, LEGEND_WIDTH, LEGEND_HEIGHT), bar)
    painter.setPen(QColor(theme.ON_IMAGE.dim))
    base = top + metrics.ascent()
    painter.drawText(QPointF(MARGIN, base), shades.low)
    painter.drawText(QPointF(MARGIN + low + LEGEND_WIDTH + 6, base), shades.high)
