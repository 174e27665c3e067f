"""The scale bar of a picture: how long it is, and at which depth that holds."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from model.scene.crop import CropBox
from model.scene.orientation import WHOLE
from model.scene.view import NEAREST_DEPTH, Projection, View
from model.scene.volume import Triple, Volume
from model.volume_files.grid import METRES

WIDEST = 0.25  # length of a bar at most, relative to the picture's shorter side

DEPTH_TEXT = "in the plane through the middle of what is shown"
"""Where a bar holds: nearer things look larger in perspective, and farther ones smaller."""

_ROUND = (5.0, 2.0, 1.0)
_METRIC = (("km", 1e3), ("m", 1.0), ("mm", 1e-3), ("µm", 1e-6), ("nm", 1e-9))


@dataclass(frozen=True)
class ScaleBar:
    """A bar of a round length."""

    share: float  # its length relative to the picture's shorter side
    text: str  # its length in the volume, such as "20 mm"


@dataclass(frozen=True)
class Scale:
    """Lengths of a volume, and the middle of what is shown of it."""

    proportions: Triple  # the volume's lengths along x, y and z, relative to its diagonal
    radius: float  # half the diagonal, in the unit
    unit: str  # of lengths; empty if unknown
    low: Triple  # corners of the box around what is shown, in fractions of the volume's lengths
    high: Triple

    @classmethod
    def of(cls, volume: Volume, shown: NDArray[np.float64] = WHOLE) -> Scale:
        """Return the scale of a volume of which these points, shape (n, 3), are shown."""
        unit = volume.file.spacing_unit
        if not unit and set(volume.spacing) == {1.0}:
            unit = "voxels"
        low, high = (tuple(ends.tolist()) for ends in (shown.min(axis=0), shown.max(axis=0)))
        return cls(volume.proportions, volume.radius, unit, low, high)

    def bar(self, view: View, crop: CropBox | None = None) -> ScaleBar | None:
        """Return the longest bar of 1, 2 or 5 units that is short enough; None close to the eye."""
        span = self.span(view, crop)
        if span is None:
            return None
        factor, unit = _unit_for(WIDEST * span, self.unit)
        most = WIDEST * span / factor
        power = 10.0 ** math.floor(math.log10(most) + 1e-12)
        length = next(part * power for part in _ROUND if part * power <= most * (1 + 1e-9))
        return ScaleBar(length * factor / span, f"{length:.12g} {unit or 'units'}")

    def length_text(self, start: ArrayLike, end: ArrayLike) -> str:
        """Write the distance of two points, in fractions of the volume's lengths."""
        across = np.subtract(end, start) * self.proportions
        length = 2 * self.radius * float(np.linalg.norm(across))
        factor, unit = _unit_for(length, self.unit)
        return f"{length / factor:.4g} {unit or 'units'}"

    def span(self, view: View, crop: CropBox | None = None) -> float | None:
        """Length that the picture's shorter side spans at the depth of the middle; None if near."""
        low, high = np.array(self.low), np.array(self.high)
        if crop is not None:
            low, high = np.maximum(low, crop.low), np.minimum(high, crop.high)
            if (low > high).any():
                low, high = np.array(crop.low), np.array(crop.high)
        middle = (low + high) / 2
        projection = Projection(view, self.proportions)
        if projection.depths(middle[None])[0] < NEAREST_DEPTH:
            return None
        return 2 * float(projection.half_sides(middle[None])[0]) * self.radius


def _unit_for(length: float, unit: str) -> tuple[float, str]:
    """Factor and name of the metric unit in which a length is 1 to 1,000; its own if not metric."""
    metres = METRES.get(unit.lower())
    if metres is None or unit.lower() not in {"km", "m", "dm", "cm", "mm", "um", "nm", "pm"}:
        return 1.0, unit
    for name, factor in _METRIC:
        if length * metres >= factor:
            return factor / metres, name
    return 1.0, unit
