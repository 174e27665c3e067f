"""Presets: transfer functions (TFs) by kind of data, and colour maps as colour TFs.

Those for CT are given in Hounsfield units (HU). For other values and kinds, they are placed by the
histogram: the background's peak, and percentiles above it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.scene.ranges import fit_to_range
from model.scene.transfer_function import ColorTF, OpacityTF, Point, Range, Stop, TransferFunction
from model.scene.value_scale import ValueScale

LOW_HU, HIGH_HU = -500.0, 500.0  # a range beyond both is in HU: air is at -1000, bone above 1000
_SMOOTHING = 5  # bins over which a histogram is averaged before the search for peaks
_FREQUENT = 0.3  # least height of a peak, relative to the highest one


@dataclass(frozen=True)
class Preset:
    """A preset TF."""

    name: str  # for users
    explanation: str
    tf: TransferFunction  # over the requested scalar range


@dataclass(frozen=True)
class _Recipe:
    """Curve and colours over places: HU, or 0 (background) to 1 (brightest voxels)."""

    name: str
    explanation: str
    points: tuple[Point, ...]
    stops: tuple[Stop, ...]


_CT = (
    _Recipe(
        "Bone white",
        "CT: bone in ivory, with nothing in front of it",
        ((130, 0.0), (220, 0.03), (450, 0.25), (1200, 0.7), (3000, 0.8)),
        (
            (130, 0.55, 0.25, 0.15), (300, 0.87, 0.68, 0.45), (700, 0.97, 0.92, 0.80),
            (1500, 1.0, 1.0, 0.97),
        ),
    ),
    _Recipe(
        "Skin",
        "CT: the outer surface of the body",
        ((-600, 0.0), (-350, 0.06), (-150, 0.5), (100, 0.6), (3000, 0.6)),
        (
            (-600, 0.45, 0.22, 0.14), (-300, 0.80, 0.52, 0.38), (-50, 0.93, 0.70, 0.56),
            (250, 0.98, 0.86, 0.76), (900, 1.0, 1.0, 0.95),
        ),
    ),
    _Recipe(
        "Vessels",
        "CT: vessels with contrast agent in red, in front of pale, translucent bone",
        ((90, 0.0), (150, 0.02), (220, 0.22), (380, 0.3), (520, 0.1), (1000, 0.18), (3000, 0.3)),
        (
            (90, 0.35, 0.02, 0.03), (200, 0.80, 0.10, 0.08), (380, 0.95, 0.35, 0.20),
            (550, 0.93, 0.86, 0.72), (1500, 1.0, 1.0, 0.97),
        ),
    ),
)  # fmt: skip

_OTHERS = (
    _Recipe(
        "Opaque surface",
        "Micro-CT: the solid, with its densest parts in another colour",
        ((0.20, 0.0), (0.30, 0.12), (0.40, 0.6), (0.75, 0.8), (1.0, 0.9)),
        (
            (0.20, 0.52, 0.44, 0.36), (0.42, 0.93, 0.84, 0.66), (0.65, 1.0, 0.93, 0.72),
            (0.82, 1.0, 0.72, 0.30), (1.0, 0.97, 0.42, 0.16),
        ),
    ),
    _Recipe(
        "Glass",
        "MR: faint surfaces, and what is bright inside them, from pale blue to white",
        ((0.12, 0.0), (0.25, 0.03), (0.45, 0.06), (0.65, 0.2), (0.85, 0.5), (1.0, 0.7)),
        (
            (0.0, 0.30, 0.42, 0.62), (0.3, 0.55, 0.70, 0.92), (0.55, 0.95, 0.80, 0.72),
            (0.8, 1.0, 0.92, 0.80), (1.0, 1.0, 1.0, 0.97),
        ),
    ),
    _Recipe(
        "Layers",
        "Simulations: translucent layers over the whole range, from blue to red",
        (
            (0.04, 0.0), (0.10, 0.05), (0.16, 0.005), (0.29, 0.005), (0.35, 0.08), (0.41, 0.01),
            (0.55, 0.01), (0.61, 0.16), (0.67, 0.02), (0.80, 0.02), (0.88, 0.4), (1.0, 0.55),
        ),
        (
            (0.0, 0.10, 0.16, 0.45), (0.15, 0.23, 0.42, 0.83), (0.38, 0.55, 0.80, 0.90),
            (0.55, 0.93, 0.93, 0.86), (0.72, 0.97, 0.70, 0.38), (0.88, 0.87, 0.27, 0.18),
            (1.0, 0.98, 0.85, 0.45),
        ),
    ),
)  # fmt: skip

_DENSE_PARTS = _Recipe(
    "Dense parts",
    "The densest voxels as opaque grains in a faint haze of the rest",
    ((0.45, 0.0), (0.6, 0.005), (0.9, 0.012), (1.0, 0.4), (1.15, 0.9)),
    (
        (0.45, 0.40, 0.55, 0.72), (0.9, 0.62, 0.74, 0.85), (1.0, 0.98, 0.75, 0.35),
        (1.3, 1.0, 0.90, 0.62),
    ),
)  # fmt: skip
"""Over places from 0, the background's most frequent value, to 1, of the densest voxels."""

DENSE_SHARE = 0.004  # fraction of all voxels that count as the densest
AIR_HU, TISSUE_HU, BONE_HU = -1000.0, 40.0, 1200.0  # of air, soft tissue and dense bone
LEAST_BONE_HU = 500.0  # that a volume with soft tissue and bone reaches


def presets(
    scalar_range: Range,
    counts: NDArray[np.int64],
    edges: NDArray[np.float64],
    units: str = "",
    scale: ValueScale = "linear",
    of_patient: bool = True,
) -> list[Preset]:
    """Return the preset TFs over a volume's scalar range, always in the same order.

    The histogram has counts (bins,) between increasing edges (bins + 1,). The unit "HU" marks
    Hounsfield units; values on a logarithmic scale never are.
    """
    marks = _landmarks(counts, edges)
    is_hu = scale == "linear" and looks_like_hu((float(edges[0]), float(edges[-1])), units)
    # CT values that are not HU are usually a linear function of HU.
    slope = (marks.tissue - marks.peak) / (TISSUE_HU - AIR_HU)
    if marks.peak + slope * (LEAST_BONE_HU - AIR_HU) > marks.highest:
        # No bone fits above it: the highest peak is not of soft tissue, but of bone.
        slope *= (TISSUE_HU - AIR_HU) / (BONE_HU - AIR_HU)
    tissue = marks.peak + slope * (TISSUE_HU - AIR_HU)
    bone = min(marks.peak + slope * (BONE_HU - AIR_HU), max(marks.highest, tissue + slope))

    def placed(value: float) -> float:
        return float(np.interp(value, (0.0, 0.5, 1.0), (marks.low, marks.middle, marks.high)))

    def of_hu(value: float) -> float:
        if is_hu:
            return value
        if value <= TISSUE_HU:
            return marks.peak + slope * (value - AIR_HU)
        return tissue + (bone - tissue) * (value - TISSUE_HU) / (BONE_HU - TISSUE_HU)

    def of_dense(value: float) -> float:
        return marks.peak + value * (marks.dense - marks.peak)

    of_ct = [Preset(r.name, r.explanation, _tf(r, scalar_range, scale, of_hu)) for r in _CT]
    others = [
        Preset(r.name, r.explanation, _tf(r, scalar_range, scale, of))
        for r, of in (*((recipe, placed) for recipe in _OTHERS), (_DENSE_PARTS, of_dense))
    ]
    return [*of_ct, *others] if of_patient else [*others, *of_ct]


def looks_like_hu(data_range: Range, units: str = "") -> bool:
    """Whether values are Hounsfield units, by their unit or by their range."""
    return units.strip().upper() == "HU" or (data_range[0] < LOW_HU and data_range[1] > HIGH_HU)


@dataclass(frozen=True)
class _Landmarks:
    """Values found in a histogram."""

    peak: float  # most frequent value of the background, and its end
    low: float
    middle: float  # middle and almost largest value of the voxels above the background
    high: float
    tissue: float  # highest frequent value above the background
    dense: float  # least value of the densest voxels: a fraction `DENSE_SHARE` of all
    highest: float  # largest value of all


def _landmarks(counts: NDArray[np.int64], edges: NDArray[np.float64]) -> _Landmarks:
    """Find the background, the highest peak in the histogram's lower half, and values above."""
    centers = (edges[:-1] + edges[1:]) / 2
    first, last = float(edges[0]), float(edges[-1])
    start = int(np.argmax(np.where(centers <= (first + last) / 2, counts, -1)))
    # The flank of the peak belongs to it.
    end = start
    while end + 1 < len(counts) and counts[end + 1] > 0.05 * counts[start]:
        end += 1
    if centers[end] > first + 0.6 * (last - first):
        end = start
    rest = counts[end + 1 :]
    if rest.sum() == 0:
        middle = (first + last) / 2
        return _Landmarks(first, first, middle, last, middle, last, last)
    shares = np.cumsum(rest) / rest.sum()
    low = float(edges[end + 1])
    high = float(edges[end + 2 + int(np.searchsorted(shares, 0.995))])
    high = max(high, low + 0.1 * (last - low))
    # In the middle between half of the voxels and half of the values.
    median = float(edges[end + 2 + int(np.searchsorted(shares, 0.5))])
    span = high - low
    middle = min(max((median + (low + high) / 2) / 2, low + 0.2 * span), high - 0.2 * span)
    width = min(_SMOOTHING, len(rest))
    smooth = np.convolve(rest, np.ones(width) / width, mode="same")
    inner = np.flatnonzero((smooth[1:-1] >= smooth[:-2]) & (smooth[1:-1] > smooth[2:])) + 1
    peaks = inner[smooth[inner] >= _FREQUENT * smooth.max()] if len(inner) else inner
    tissue = float(centers[end + 1 + int(peaks[-1])]) if len(peaks) else middle
    # Otherwise the HU scale would be reversed.
    tissue = max(tissue, float(centers[start]) + 0.05 * (last - first))
    # A bin or more above the background, as places must not coincide.
    whole = np.cumsum(counts) / counts.sum()
    dense = float(edges[min(int(np.searchsorted(whole, 1 - DENSE_SHARE)), len(counts) - 1)])
    dense = max(dense, float(centers[start]) + 0.02 * (last - first))
    return _Landmarks(float(centers[start]), low, middle, high, tissue, dense, last)


def _tf(
    recipe: _Recipe, scalar_range: Range, scale: ValueScale, value_of: Callable[[float], float]
) -> TransferFunction:
    """Return a recipe over a scalar range."""
    lo, hi = scalar_range
    points = tuple((value_of(place), opacity) for place, opacity in recipe.points)
    stops = tuple((value_of(place), r, g, b) for place, r, g, b in recipe.stops)
    own = points[0][0], points[-1][0]
    # Curve and stops are constant beyond their ends, and may reach beyond the range.
    opacity = OpacityTF((min(lo, own[0]), max(hi, own[1])), points=points, scale=scale)
    color = ColorTF(opacity.scalar_range, stops)
    return fit_to_range(TransferFunction(opacity, color), scalar_range)


COLOR_MAPS: dict[str, str] = {
    "Viridis": "bids:viridis", "Magma": "bids:magma", "Inferno": "bids:inferno",
    "Plasma": "bids:plasma", "Cividis": "cividis:cividis", "Batlow": "crameri:batlow",
    "Grey": "matlab:gray", "Blue, white, red (diverging)": "matplotlib:coolwarm",
}  # fmt: skip
"""Names of colour maps in `cmap`, by the names that users see."""

MAP_STOPS = 9  # number of stops of a colour TF made from a map: as many as a user can move


def map_colors(name: str, count: int) -> NDArray[np.float64]:
    """Return colours (count, 3), in [0, 1], spread evenly over a map of :data:`COLOR_MAPS`."""
    # Imported here to keep the window's start fast.
    from cmap import Colormap

    colors = Colormap(COLOR_MAPS[name])(np.linspace(0.0, 1.0, count))
    return np.asarray(colors, dtype=np.float64)[:, :3].clip(0.0, 1.0)


def color_tf_of_map(name: str, scalar_range: Range) -> ColorTF:
    """Return a colour TF of nine stops, evenly over a range."""
    lo, hi = scalar_range
    values = [lo, *np.linspace(lo, hi, MAP_STOPS)[1:-1].tolist(), hi]
    colors = map_colors(name, MAP_STOPS).tolist()
    stops = tuple((v, r, g, b) for v, (r, g, b) in zip(values, colors, strict=True))
    return ColorTF(scalar_range, stops)


def reversed_colors(color: ColorTF) -> ColorTF:
    """Return the colour TF mirrored in the middle of its range."""
    lo, hi = color.scalar_range
    # The ends stay exact; in a narrow range far from zero, lo + hi - hi would be rounded.
    mirrored = {lo: hi, hi: lo}
    stops = tuple(
        (mirrored.get(value, min(max(lo + (hi - value), lo), hi)), *rgb)
        for value, *rgb in reversed(color.stops)
    )
    return ColorTF(color.scalar_range, stops)  # type: ignore[arg-type]
