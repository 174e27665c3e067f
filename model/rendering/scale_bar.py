"""A picture's scale bar: its length, and the depth at which it is valid."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from model.scene.clip_plane import WHOLE_PART, ShownPart
from model.scene.orientation import WHOLE
from model.scene.view import NEAREST_DEPTH, Projection, View
from model.scene.volume import Triple, Volume
from model.volume_files.grid import METRES

WIDEST = 0.25  # largest length of a bar, relative to the picture's shorter side

DEPTH_TEXT = "in the plane through the middle of what is shown"
"""Depth at which a bar is valid: in perspective, nearer things look larger."""

_ROUND = (5.0, 2.0, 1.0)
_METRIC = (("km", 1e3), ("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9))
_METRIC_UNITS = {"km", "m", "dm", "cm", "mm", "um", "nm", "pm"}
_CUBED = (_METRIC[1], ("cm", 1e-2), *_METRIC[2:])  # units of volumes


@dataclass(frozen=True)
class ScaleBar:
    """A bar of a round length."""

    share: float  # its length relative to the picture's shorter side
    text: str  # its length in the volume, such as "20 mm"


@dataclass(frozen=True)
class Scale:
    """Lengths of a volume, and the middle of its shown part."""

    proportions: Triple  # the volume's lengths along x, y and z, relative to its diagonal
    radius: float  # half the diagonal, in the unit
    unit: str  # of lengths; empty if unknown
    low: Triple  # corners of the box around the shown part, in fractions of the volume's lengths
    high: Triple

    @classmethod
    def of(cls, volume: Volume, shown: NDArray[np.float64] = WHOLE) -> Scale:
        """Return the scale of a volume for its shown points (n, 3)."""
        unit = volume.file.spacing_unit
        if not unit and set(volume.spacing) == {1.0}:
            unit = "voxels"
        low, high = (tuple(ends.tolist()) for ends in (shown.min(axis=0), shown.max(axis=0)))
        return cls(volume.proportions, volume.radius, unit, low, high)

    def bar(self, view: View, part: ShownPart = WHOLE_PART) -> ScaleBar | None:
        """Return the longest bar of a round length that fits; None close to the eye."""
        span = self.span(view, part)
        if span is None:
            return None
        factor, unit = _unit_for(WIDEST * span, self.unit)
        most = WIDEST * span / factor
        power = 10.0 ** math.floor(math.log10(most) + 1e-12)
        length = next(part * power for part in _ROUND if part * power <= most * (1 + 1e-9))
        return ScaleBar(length * factor / span, f"{length:.12g} {unit or 'units'}")

    def length_text(self, start: ArrayLike, end: ArrayLike) -> str:
        """Format the distance of two points, in fractions of the volume's lengths."""
        across = np.subtract(end, start) * self.proportions
        length = 2 * self.radius * float(np.linalg.norm(across))
        factor, unit = _unit_for(length, self.unit)
        return f"{length / factor:.4g} {unit or 'units'}"

    def span(self, view: View, part: ShownPart = WHOLE_PART) -> float | None:
        """Length of the picture's shorter side at the depth of the middle; None if near."""
        crop = part.crop
        low, high = np.maximum(self.low, crop.low), np.minimum(self.high, crop.high)
        if (low > high).any():
            low, high = np.array(crop.low), np.array(crop.high)
        corners = np.array(list(itertools.product(*zip(low, high, strict=True))))
        if part.clip is not None:
            kept = corners[part.clip.depths(corners, self.proportions) >= 0]
            cut = part.clip.outline(crop, self.proportions)
            left = np.clip(np.vstack([kept, cut]), low, high)
            corners = left if len(left) else corners
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        projection = Projection(view, self.proportions)
        if projection.depths(middle[None])[0] < NEAREST_DEPTH:
            return None
        return 2 * float(projection.half_sides(middle[None])[0]) * self.radius


def volume_text(voxels: int, volume: Volume) -> str:
    """Format the volume of some voxels in the file's unit, or their number without one."""
    unit = volume.file.spacing_unit
    if unit.lower() not in METRES:
        return f"{voxels:,} voxel{'' if voxels == 1 else 's'}"
    metres, size = METRES[unit.lower()], voxels * math.prod(volume.spacing)
    name = "µm" if unit == "um" else unit
    if unit in _METRIC_UNITS:
        larger = [each for each in _CUBED if each[1] > metres and size * metres**3 >= each[1] ** 3]
        name, factor = (larger or [(name, metres)])[0]
        size *= (metres / factor) ** 3
    return f"{size:,.0f} {name}³" if size >= 100 else f"{size:.3g} {name}³"


def _unit_for(length: float, unit: str) -> tuple[float, str]:
    """Factor and name of the metric unit in which a length is 1 to 1,000, or its own unit."""
    metres = METRES.get(unit.lower())
    if metres is None or unit.lower() not in _METRIC_UNITS:
        return 1.0, unit
    for name, factor in _METRIC:
        if length * metres >= factor:
            return factor / metres, name
    return 1.0, unit
