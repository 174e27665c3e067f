"""Points of the map as one picture, and lines of equal density."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtGui import QImage

RADIUS = 2
"""Radius of a point at a zoom of 1, in pixels; closer points are larger."""

Colors = NDArray[np.uint8]


def draw_points(
    pixels: NDArray[np.float64], colors: Colors, size: tuple[int, int], radius: float
) -> QImage:
    """Paint points as soft discs; later ones lie above earlier ones.

    Ten thousand points take a few milliseconds, and moving the mouse over the map then costs
    one picture.

    Parameters
    ----------
    pixels : ndarray, shape (n, 2)
    colors : ndarray of uint8, shape (n, 3)
    size : tuple of int
        Width and height of the picture.
    radius : float
        In pixels.
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


def density_contours(places: NDArray[np.floating], levels: int = 4) -> list[NDArray[np.float64]]:
    """Lines (k, 2) of equal density of points on the map, the sparsest first."""
    from scipy.ndimage import gaussian_filter
    from skimage.measure import find_contours

    bins, reach = 96, 1.15
    counts, _, _ = np.histogram2d(
        places[:, 1], places[:, 0], bins, [[-reach, reach], [-reach, reach]]
    )
    density = gaussian_filter(counts, 3.0)
    lines = []
    for level in np.linspace(0, density.max(), levels + 2)[1:-1]:
        for line in find_contours(density, level):
            y, x = (line.T + 0.5) / bins * 2 * reach - reach
            lines.append(np.stack([x, y], axis=1))
    return lines
