"""The distant light of lit scenes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from model.errors import TfscopeError


@dataclass(frozen=True)
class LightDirection:
    """Direction to the distant light, relative to the view, in degrees.

    Positive azimuth is to the viewer's right, positive elevation upwards;
    (0, 0) is a headlight. By default the light comes from the upper left, and near enough to
    the viewer that surfaces which face them are bright.

    Raises
    ------
    TfscopeError
        For angles that are not finite numbers.
    """

    azimuth: float = -30.0
    elevation: float = 30.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and math.isfinite(value)):
                raise TfscopeError(f"The light's {name} is {value!r}; give degrees.")

    @classmethod
    def parse(cls, text: str) -> LightDirection:
        """Read ``"AZ,EL"``, in degrees.

        Raises
        ------
        TfscopeError
            When the text is not a pair of finite numbers.
        """
        try:
            azimuth, elevation = (float(part) for part in text.split(","))
        except ValueError:
            raise TfscopeError(
                f"'{text}' is not a light direction; give azimuth,elevation in degrees relative "
                "to the view, for example -30,30."
            ) from None
        return cls(azimuth, elevation)

    def towards(self) -> tuple[float, float, float]:
        """Unit vector to the light, with components along the view's right, up and back."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        return (
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        )


@dataclass(frozen=True)
class LightRange:
    """Training range of the light direction in a scene with a movable light, in degrees.


    Raises
    ------
    TfscopeError
        For limits outside that range.
    """

    max_azimuth: float = 80.0
    max_elevation: float = 70.0
    """Limits of the angles' absolute values, above 0 and up to 90, so that the light stays on the
    viewer's side."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and 0 < value <= 90):
                raise TfscopeError(f"The light range's {name} is {value!r}; give degrees to 90.")

    def nearest(self, light: LightDirection) -> LightDirection:
        """Return the direction within the range that is nearest to another, angle by angle."""
        return LightDirection(
            min(max(light.azimuth, -self.max_azimuth), self.max_azimuth),
            min(max(light.elevation, -self.max_elevation), self.max_elevation),
        )
