"""The map in pixels: the part in sight, the brush, points with their colours, and marks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPen

from app import theme
from app.image_view.image_canvas import paint_plate
from app.state.latent_session import LatentSession, Place
from model.latent.latent_map import CELLS, Brush
from model.scene.ranges import value_text

CLOSEST, FARTHEST = 40.0, 0.8  # limits of the zoom; at 1 the whole map is in sight
WHEEL_FACTOR = 1.2  # of the zoom, for each step of the wheel
AROUND = 1.06  # the map with a margin, at a zoom of 1


@dataclass(frozen=True)
class MapFrame:
    """A square map, -1..1 along both axes, in a widget of some pixels around a place."""

    width: int
    height: int
    zoom: float = 1.0
    center: tuple[float, float] = (0.0, 0.0)

    @property
    def scale(self) -> float:
        """Pixels per unit of the map."""
        return min(self.width, self.height) / (2 * AROUND) * self.zoom

    def pixels(self, places: NDArray[np.floating]) -> NDArray[np.float64]:
        """Pixels (n, 2), to the right and down, of places (n, 2)."""
        offset = (places.astype(np.float64) - self.center) * self.scale
        return np.asarray(offset * (1, -1) + (self.width / 2, self.height / 2))

    def pixel(self, place: tuple[float, float]) -> QPointF:
        """Pixel of one place."""
        (x, y), s = self.center, self.scale
        return QPointF(self.width / 2 + (place[0] - x) * s, self.height / 2 - (place[1] - y) * s)

    def place(self, pixel: QPointF) -> tuple[float, float]:
        """Place of a pixel."""
        (x, y), s = self.center, self.scale
        return x + (pixel.x() - self.width / 2) / s, y - (pixel.y() - self.height / 2) / s

    def rectangle(self, brush: tuple[float, float, float, float]) -> QRectF:
        """Rectangle in pixels of left, lower, right and upper edge."""
        left, lower, right, upper = brush
        return QRectF(self.pixel((left, upper)), self.pixel((right, lower))).normalized()

    def zoomed(self, factor: float, at: QPointF) -> MapFrame:
        """Zoom in by a factor; the place under a pixel stays there."""
        place = self.place(at)
        zoom = min(max(self.zoom * factor, FARTHEST), CLOSEST)
        closer = replace(self, zoom=zoom)
        moved = closer.place(at)
        (x, y) = self.center
        return replace(closer, center=(x + place[0] - moved[0], y + place[1] - moved[1]))

    def shifted(self, dx: float, dy: float) -> MapFrame:
        """Move the map by pixels."""
        (x, y), s = self.center, self.scale
        x, y = (min(max(at, -AROUND), AROUND) for at in (x - dx / s, y + dy / s))
        return replace(self, center=(x, y))


Grip = Literal["new", "move", "pan", "left", "right", "lower", "upper"]

REACH = 7  # distance in pixels at which the brush's edges are gripped


def grips_at(frame: MapFrame, brush: Brush, at: QPointF) -> tuple[Grip, ...]:
    """Return the edges of the brush at a pixel, "move" inside it, nothing outside."""
    rect = frame.rectangle(brush)
    if not rect.adjusted(-REACH, -REACH, REACH, REACH).contains(at):
        return ()
    grips: list[Grip] = []
    if abs(at.x() - rect.left()) <= REACH:
        grips.append("left")
    elif abs(at.x() - rect.right()) <= REACH:
        grips.append("right")
    if abs(at.y() - rect.bottom()) <= REACH:
        grips.append("lower")
    elif abs(at.y() - rect.top()) <= REACH:
        grips.append("upper")
    return tuple(grips) or ("move",)


def dragged(
    grips: tuple[Grip, ...], before: Brush, start: tuple[float, float], end: tuple[float, float]
) -> Brush:
    """Return the brush after a drag from one place of the map to another."""
    (ax, ay), (bx, by) = start, end
    if grips == ("new",):
        return min(ax, bx), min(ay, by), max(ax, bx), max(ay, by)
    left, lower, right, upper = before
    dx, dy = bx - ax, by - ay
    if grips == ("move",):
        return left + dx, lower + dy, right + dx, upper + dy
    left += dx if "left" in grips else 0
    right += dx if "right" in grips else 0
    lower += dy if "lower" in grips else 0
    upper += dy if "upper" in grips else 0
    return min(left, right), min(lower, upper), max(left, right), max(lower, upper)


CURSORS: dict[tuple[Grip, ...], Qt.CursorShape] = {
    ("left", "lower"): Qt.CursorShape.SizeBDiagCursor,
    ("right", "upper"): Qt.CursorShape.SizeBDiagCursor,
    ("left", "upper"): Qt.CursorShape.SizeFDiagCursor,
    ("right", "lower"): Qt.CursorShape.SizeFDiagCursor,
    ("left",): Qt.CursorShape.SizeHorCursor,
    ("right",): Qt.CursorShape.SizeHorCursor,
    ("lower",): Qt.CursorShape.SizeVerCursor,
    ("upper",): Qt.CursorShape.SizeVerCursor,
}
"""Mouse cursors over the brush's edges; elsewhere it is a cross."""

BRUSH = "#f0f0f0"
PRESENT = theme.ON_IMAGE.attention
HANDLE = 4.0
RADIUS = 2  # radius of a point at a zoom of 1, in pixels; closer points are larger
LEGEND_WIDTH, LEGEND_HEIGHT, MARGIN = 84, 6, 10
BACKING = 200  # opacity of the background behind texts, of 255

HIDDEN = (45, 46, 49)  # colour of points that are filtered out
NOTHING = (64, 66, 70)  # colour of TFs that show nothing or a solid block, or are not known yet


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
    first, last = (value_text(end, frame.scalar_range, frame.scale) for end in (low, high))
    return Shades(colors, order, f"Value {first}", f"{last} {units}".strip())


@cache
def lookup_table() -> NDArray[np.uint8]:
    """Colours (256, 3) of the map, perceptually uniform."""
    table = pg.colormap.get("viridis").getLookupTable(0.12, 1.0, 256)
    return np.asarray(table[:, :3], dtype=np.uint8)


def draw_points(
    pixels: NDArray[np.float64], colors: NDArray[np.uint8], size: tuple[int, int], radius: float
) -> QImage:
    """Paint points as soft discs; later ones lie above earlier ones."""
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
    box = QRectF(left - 4, top - 3, width + 8, metrics.height() + 6)
    paint_plate(painter, box, theme.ON_IMAGE.window, BACKING)
    painter.setPen(QColor(theme.ON_IMAGE.dim))
    painter.drawText(QPointF(left, top + metrics.ascent()), text)


def paint_legend(painter: QPainter, frame: MapFrame, shades: Shades) -> None:
    """Paint the colour bar between its numbers in the lower left corner."""
    metrics = QFontMetricsF(painter.font())
    low, high = (metrics.horizontalAdvance(text) + 6 for text in (shades.low, shades.high))
    top = frame.height - MARGIN - metrics.height()
    width = low + LEGEND_WIDTH + high
    box = QRectF(MARGIN - 4, top - 3, width + 8, metrics.height() + 6)
    paint_plate(painter, box, theme.ON_IMAGE.window, BACKING)
    table = lookup_table()
    bar = QImage(table.tobytes(), len(table), 1, 3 * len(table), QImage.Format.Format_RGB888)
    middle = top + (metrics.height() - LEGEND_HEIGHT) / 2
    painter.drawImage(QRectF(MARGIN + low, middle, LEGEND_WIDTH, LEGEND_HEIGHT), bar)
    painter.setPen(QColor(theme.ON_IMAGE.dim))
    base = top + metrics.ascent()
    painter.drawText(QPointF(MARGIN, base), shades.low)
    painter.drawText(QPointF(MARGIN + low + LEGEND_WIDTH + 6, base), shades.high)
