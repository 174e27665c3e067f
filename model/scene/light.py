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

    @classmethod
    def parse(cls, text: str) -> LightDirection:
        """Read ``"AZ,EL"``, in degrees.

        Raises
        ------
        TfscopeError
            When the text is no pair of finite numbers.
        """
        try:
            azimuth, elevation = (float(part) for part in text.split(","))
        except ValueError:
            raise TfscopeError(
                f"'{text}' is not a light direction; give azimuth,elevation in degrees relative "
                "to the view, for example -45,45."
            ) from None
        return cls(azimuth, elevation)

    def towards(self) -> tuple[float, float, float]:
        """Direction to the light, of length 1, along the view's right, up and back."""
        azimuth, elevation = math.radians(self.azimuth), math.radians(self.elevation)
        return (
            math.sin(azimuth) * math.cos(elevation),
            math.sin(elevation),
            math.cos(azimuth) * math.cos(elevation),
        )


@dataclass(frozen=True)
class LightRange:
    """The light directions that a scene with a movable light is modelled for, in degrees.

    Attributes
    ----------
    max_azimuth, max_elevation : float
        Both angles run over +- these, 0..90: the light stays on the viewer's side.
    """

    max_azimuth: float = 80.0
    max_elevation: float = 70.0

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (isinstance(value, int | float) and 0 < value <= 90):
                raise TfscopeError(f"The light range's {name} is {value!r}; give degrees to 90.")
