"""The part of the map that is in sight, in pixels; and the brush there, as the mouse grips it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt

from model.latent.latent_map import Brush

CLOSEST, FARTHEST = 40.0, 0.8
"""Limits of the zoom; at 1 the whole map is in sight."""

WHEEL_FACTOR = 1.2
"""Of the zoom, for each step of the wheel."""

MARGIN = 1.06
"""The map with a margin, at a zoom of 1."""


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
        return min(self.width, self.height) / (2 * MARGIN) * self.zoom

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
        """Come closer by a factor; what is under a pixel stays there."""
        place = self.place(at)
        zoom = min(max(self.zoom * factor, FARTHEST), CLOSEST)
        closer = replace(self, zoom=zoom)
        moved = closer.place(at)
        (x, y) = self.center
        return replace(closer, center=(x + place[0] - moved[0], y + place[1] - moved[1]))

    def shifted(self, dx: float, dy: float) -> MapFrame:
        """Move the map by pixels."""
        (x, y), s = self.center, self.scale
        limit = MARGIN
        return replace(
            self,
            center=(
                min(max(x - dx / s, -limit), limit),
                min(max(y + dy / s, -limit), limit),
            ),
        )


Grip = Literal["new", "move", "pan", "left", "right", "lower", "upper"]

REACH = 7
"""Distance in pixels at which the brush's edges are gripped."""


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


def cursor_of(grips: tuple[Grip, ...]) -> Qt.CursorShape:
    """Return the shape of the mouse over what it would grip."""
    shapes = Qt.CursorShape
    if grips in (("left", "lower"), ("right", "upper")):
        return shapes.SizeBDiagCursor
    if grips in (("left", "upper"), ("right", "lower")):
        return shapes.SizeFDiagCursor
    if grips in (("left",), ("right",)):
        return shapes.SizeHorCursor
    if grips in (("lower",), ("upper",)):
        return shapes.SizeVerCursor
    return shapes.CrossCursor
