"""Transfer functions to begin with, one per kind of data.

Those for CT are given in Hounsfield units (HU). Where a volume's values are not HU, and
for the other kinds, they are placed by the histogram: the peak of the background, and
percentiles of what is above it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.range_fitting import fit_to_range
from model.scene.transfer_function import (
    ColorTF,
    OpacityTF,
    Range,
    TransferFunction,
)

LOW_HU, HIGH_HU = -500.0, 500.0
"""A range that reaches beyond both is taken for HU: air is at -1000, dense bone above 1000."""

_Point = tuple[float, float]
_Stop = tuple[float, float, float, float]


@dataclass(frozen=True)
class Preset:
    """A TF to begin with.

    Attributes
    ----------
    name, explanation : str
        For users.
    tf : TransferFunction
        Over the scalar range asked for.
    """

    name: str
    explanation: str
    tf: TransferFunction


@dataclass(frozen=True)
class _Recipe:
    """Curve and colours over places: HU, or 0 (background) to 1 (brightest voxels)."""

    name: str
    explanation: str
    points: tuple[_Point, ...]
    stops: tuple[_Stop, ...]


_CT = (
    _Recipe(
        "CT bone",
        "Bone in ivory, with nothing in front of it",
        ((130, 0.0), (220, 0.03), (450, 0.25), (1200, 0.7), (3000, 0.8)),
        (
            (130, 0.55, 0.25, 0.15),
            (300, 0.87, 0.68, 0.45),
            (700, 0.97, 0.92, 0.80),
            (1500, 1.0, 1.0, 0.97),
        ),
    ),
    _Recipe(
        "CT skin",
        "The outer surface of the body",
        ((-600, 0.0), (-350, 0.06), (-150, 0.5), (100, 0.6), (3000, 0.6)),
        (
            (-600, 0.45, 0.22, 0.14),
            (-300, 0.80, 0.52, 0.38),
            (-50, 0.93, 0.70, 0.56),
            (250, 0.98, 0.86, 0.76),
            (900, 1.0, 1.0, 0.95),
        ),
    ),
    _Recipe(
        "CT vessels",
        "Vessels with contrast agent in red before pale, translucent bone",
        ((90, 0.0), (150, 0.02), (220, 0.22), (380, 0.3), (520, 0.1), (1000, 0.18), (3000, 0.3)),
        (
            (90, 0.35, 0.02, 0.03),
            (200, 0.80, 0.10, 0.08),
            (380, 0.95, 0.35, 0.20),
            (550, 0.93, 0.86, 0.72),
            (1500, 1.0, 1.0, 0.97),
        ),
    ),
)

_OTHERS = (
    _Recipe(
        "MR",
        "Faint surfaces, and inside them what is bright, from blue-grey to white",
        ((0.12, 0.0), (0.25, 0.015), (0.45, 0.04), (0.65, 0.10), (0.85, 0.3), (1.0, 0.45)),
        (
            (0.0, 0.05, 0.07, 0.13),
            (0.3, 0.36, 0.42, 0.55),
            (0.55, 0.78, 0.62, 0.56),
            (0.8, 0.98, 0.86, 0.72),
            (1.0, 1.0, 1.0, 0.97),
        ),
    ),
    _Recipe(
        "Micro-CT",
        "The solid as a surface, its densest parts in another colour",
        ((0.25, 0.0), (0.38, 0.05), (0.52, 0.35), (0.75, 0.6), (1.0, 0.85)),
        (
            (0.25, 0.22, 0.20, 0.24),
            (0.45, 0.62, 0.55, 0.47),
            (0.65, 0.90, 0.80, 0.62),
            (0.85, 0.98, 0.72, 0.35),
            (1.0, 0.95, 0.45, 0.18),
        ),
    ),
    _Recipe(
        "Simulation",
        "Translucent layers all over the range, from blue over white to red",
        (
            (0.04, 0.0), (0.10, 0.05), (0.16, 0.005), (0.29, 0.005), (0.35, 0.08), (0.41, 0.01),
            (0.55, 0.01), (0.61, 0.16), (0.67, 0.02), (0.80, 0.02), (0.88, 0.4), (1.0, 0.55),
        ),
        (
            (0.0, 0.10, 0.16, 0.45),
            (0.15, 0.23, 0.42, 0.83),
            (0.38, 0.55, 0.80, 0.90),
            (0.55, 0.93, 0.93, 0.86),
            (0.72, 0.97, 0.70, 0.38),
            (0.88, 0.87, 0.27, 0.18),
            (1.0, 0.98, 0.85, 0.45),
        ),
    ),
)  # fmt: skip

_HU_PLACES = ((-1000.0, 0.0), (-300.0, 0.2), (40.0, 0.45), (250.0, 0.62), (1200.0, 1.0))
"""Places between background and brightest voxels that stand for HU where there are none."""


def presets(
    scalar_range: Range,
    counts: NDArray[np.int64],
    edges: NDArray[np.float64],
    units: str = "",
) -> list[Preset]:
    """Return TFs to begin with over a volume's scalar range.

    Parameters
    ----------
    scalar_range : tuple of float
        Range of the TFs.
    counts : ndarray of int64, shape (bins,)
        Histogram of the volume.
    edges : ndarray of float64, shape (bins + 1,)
        Increasing.
    units : str
        Unit of the scalars; "HU" says that values are Hounsfield units.
    """
    places = np.array(_landmarks(counts, edges))
    hu, share = np.array(_HU_PLACES).T
    is_hu = looks_like_hu((float(edges[0]), float(edges[-1])), units)

    def placed(value: float) -> float:
        return float(np.interp(value, (0.0, 0.5, 1.0), places))

    def of_hu(value: float) -> float:
        return value if is_hu else placed(float(np.interp(value, hu, share)))

    return [
        *(Preset(r.name, r.explanation, _tf(r, scalar_range, of_hu)) for r in _CT),
        *(Preset(r.name, r.explanation, _tf(r, scalar_range, placed)) for r in _OTHERS),
    ]


def looks_like_hu(data_range: Range, units: str = "") -> bool:
    """Whether values are Hounsfield units, by their unit or by their range."""
    return units.strip().upper() == "HU" or (data_range[0] < LOW_HU and data_range[1] > HIGH_HU)


def _landmarks(counts: NDArray[np.int64], edges: NDArray[np.float64]) -> list[float]:
    """Values at the places 0, 0.5 and 1: background, middle and brightest voxels.

    The background is the highest peak of the histogram's lower half, by number of voxels; the
    others are percentiles of the voxels above it.
    """
    centers = (edges[:-1] + edges[1:]) / 2
    below = centers <= (edges[0] + edges[-1]) / 2
    start = int(np.argmax(np.where(below, counts, -1)))
    # The flank of the peak belongs to it.
    end = start
    while end + 1 < len(counts) and counts[end + 1] > 0.05 * counts[start]:
        end += 1
    if centers[end] > edges[0] + 0.6 * (edges[-1] - edges[0]):
        end = start
    rest = counts[end + 1 :]
    if rest.sum() == 0:
        return [float(edges[0]), float((edges[0] + edges[-1]) / 2), float(edges[-1])]
    shares = np.cumsum(rest) / rest.sum()
    low = float(edges[end + 1])
    high = float(edges[end + 2 + int(np.searchsorted(shares, 0.995))])
    high = max(high, low + 0.1 * (float(edges[-1]) - low))
    # In the middle between half of the voxels and half of the values.
    median = float(edges[end + 2 + int(np.searchsorted(shares, 0.5))])
    middle = (median + (low + high) / 2) / 2
    span = high - low
    return [low, min(max(middle, low + 0.2 * span), high - 0.2 * span), high]


def _tf(
    recipe: _Recipe, scalar_range: Range, value_of: Callable[[float], float]
) -> TransferFunction:
    """Return a recipe over a scalar range."""
    lo, hi = scalar_range
    points = tuple((value_of(place), opacity) for place, opacity in recipe.points)
    stops = tuple((value_of(place), r, g, b) for place, r, g, b in recipe.stops)
    own = points[0][0], points[-1][0]
    # Curve and stops are constant beyond their ends, and may reach beyond the range.
    opacity = OpacityTF((min(lo, own[0]), max(hi, own[1])), points=points)
    color = ColorTF(opacity.scalar_range, stops)
    return fit_to_range(TransferFunction(opacity, color), scalar_range)
