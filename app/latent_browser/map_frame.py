"""The part of the map that is in sight: places to pixels and back."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF

CLOSEST, FARTHEST = 40.0, 0.8
"""Limits of the zoom; at 1 the whole map is in sight."""

WHEEL_FACTOR = 1.2
"""Of the zoom, for each step of the wheel."""

MARGIN = 1.06
"""The map with a margin, at a zoom of 1."""


@dataclass(frozen=True)
class MapFrame:
    """A square map, -1..1 along both axes, in a widget of some size.

    Attributes
    ----------
    width, height : int
        In pixels.
    center : tuple of float
        Place in the middle of the widget.
    """

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
