"""Choice of the angles from which a volume has the most to see."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from model.scene.axes import upright_frame
from model.scene.view import View

FACING = (0.0, 30.0, -30.0)
"""Azimuths of a volume whose file says where its front is, the usual one first."""

AROUND = (30.0, -30.0, 60.0, 0.0, -60.0)
"""Azimuths of other volumes, the usual one first."""

ELEVATIONS = (15.0, 35.0)
"""The usual elevation, and that of slabs that lie."""

SLAB = 0.65
"""Height of a slab that lies, at most, as a part of its mean width."""

WORTH = 1.3
"""Factor by which an unusual view must show more."""

NEARLY = 0.9
"""Part of the most that a more usual one of them may show in its place."""

OUTLINE = 32
"""Tangents around an outline whose area is measured."""


def home_angles(offsets: NDArray[np.float64], up: str, front: str = "") -> tuple[float, float]:
    """Azimuth and elevation of the usual view, or of a neighbour that shows much more.

    A slab that lies is seen from further above.

    What is compared is the area within the outline of what is shown, without perspective.

    Parameters
    ----------
    offsets : ndarray of float64, shape (n, 3)
        Around what is shown, in lengths along x, y and z.
    up, front : str
        See :func:`upright_frame`; an empty front for one that is not known.
    """
    turned = offsets @ upright_frame(up, front).T
    azimuths = FACING if front else AROUND
    across, depth, height = np.ptp(turned, axis=0)
    elevations = ELEVATIONS[1:] if height <= SLAB * (across + depth) / 2 else ELEVATIONS
    candidates = [(azimuth, elevation) for elevation in elevations for azimuth in azimuths]
    areas = [_outlined_area(turned @ View(*angles).basis()[:2].T) for angles in candidates]
    most = max(areas)
    if most <= WORTH * areas[0]:
        return candidates[0]
    return next(c for c, area in zip(candidates, areas, strict=True) if area >= NEARLY * most)


def _outlined_area(places: NDArray[np.float64]) -> float:
    """Area of the polygon whose sides touch places (n, 2) in evenly spaced directions."""
    step = 2 * math.pi / OUTLINE
    directions = step * np.arange(OUTLINE)
    heights = (places @ np.stack([np.cos(directions), np.sin(directions)])).max(axis=0)
    around = np.roll(heights, 1) + np.roll(heights, -1)
    sides = (around - 2 * math.cos(step) * heights) / math.sin(step)
    return float(heights @ sides) / 2
