"""The distant light of lit scenes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from model.errors import TfscopeError


@dataclass(frozen=True)
class LightDirection:
    """Direction to the distant light, relative to the view, in degrees.

    Azimuth turns it to the viewer's right, elevation lifts it; (0, 0) is a
    headlight.
    """

    azimuth: float = -45.0
    elevation: float = 45.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and math.isfinite(value)):
                raise TfscopeError(f"The light's {name} is {value!r}; give degrees.")

    def towards(self) -> tuple[float, float, float]:
        """Direction to the light, of length 1, along the view's right, up and back."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        return (
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        )
