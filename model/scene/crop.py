"""The crop box: the part of a volume that is shown."""

from __future__ import annotations

import math
from dataclasses import dataclass

from model.errors import TfscopeError
from model.scene.volume import Triple

LEAST_LENGTH = 0.005  # shortest side of a crop box, as a fraction of the volume's


@dataclass(frozen=True)
class CropBox:
    """Six planes parallel to the volume's faces; the part between them is shown.

    Along x, y and z, as fractions of the volume's extent, 0 <= low < high <= 1. Raises
    :class:`TfscopeError` for others, or a box thinner than :data:`LEAST_LENGTH`.
    """

    low: Triple = (0.0, 0.0, 0.0)
    high: Triple = (1.0, 1.0, 1.0)  # fractions of the volume's extent, 0 <= low < high <= 1

    def __post_init__(self) -> None:
        for axis, low, high in zip("xyz", self.low, self.high, strict=True):
            if not (math.isfinite(low) and math.isfinite(high) and low >= 0 and high <= 1):
                raise TfscopeError(
                    f"The crop box's planes along {axis} are {low:g} and {high:g}; "
                    "give fractions of the volume from 0 to 1."
                )
            # Rounding must not exclude 0.1 to 0.105.
            if high - low < LEAST_LENGTH * (1 - 1e-9):
                raise TfscopeError(
                    f"The crop box from {low:g} to {high:g} along {axis} is empty; "
                    f"make it at least {LEAST_LENGTH:g} long."
                )

    @classmethod
    def parse(cls, text: str) -> CropBox:
        """Parse ``"X0,X1,Y0,Y1,Z0,Z1"``; raise :class:`TfscopeError` for anything else."""
        try:
            x0, x1, y0, y1, z0, z1 = (float(part) for part in text.split(","))
        except ValueError:
            raise TfscopeError(
                f"'{text}' is not a crop box; give x0,x1,y0,y1,z0,z1 as fractions of the volume, "
                "for example 0,1,0,0.5,0,1."
            ) from None
        return cls((x0, y0, z0), (x1, y1, z1))

    @property
    def is_whole(self) -> bool:
        """Whether the box contains the whole volume."""
        return self == CropBox()

    def with_plane(
        self, axis: int, side: int, place: float, least: float = LEAST_LENGTH
    ) -> CropBox:
        """Return the box with one plane moved as far as the volume and the opposite plane allow.

        The axis is 0, 1 or 2; the side is 0 for the lower plane, 1 for the upper one; the place is
        a fraction of the volume's extent.
        """
        low, high = self.low[axis], self.high[axis]
        if side == 0:
            return self.with_span(axis, min(max(place, 0.0), max(high - least, 0.0)), high)
        return self.with_span(axis, low, max(min(place, 1.0), min(low + least, 1.0)))

    def with_span(self, axis: int, low: float, high: float) -> CropBox:
        """Return the box with both planes along an axis moved; errors are those of a new box."""
        lows, highs = list(self.low), list(self.high)
        lows[axis], highs[axis] = low, high
        (x0, y0, z0), (x1, y1, z1) = lows, highs
        return CropBox((x0, y0, z0), (x1, y1, z1))


WITHOUT_VOLUME = (2, 2, 2)  # dimensions before a volume is opened; these cannot be cropped


def voxel_at(place: float, count: int) -> int:
    """Return the voxel nearest to a plane, given as a fraction of the volume, from 0."""
    return round(place * (count - 1))


def place_of(voxel: int, count: int) -> float:
    """Return a plane through a voxel's center, as a fraction of the volume."""
    return voxel / (count - 1)


def least_length(count: int) -> float:
    """Return the shortest side of a crop box, as a fraction: one voxel or the general limit."""
    return max(LEAST_LENGTH, 1 / (count - 1))


def axis_name(axis: int, labels: tuple[str, ...]) -> str:
    """Return the name of axis 0, 1 or 2, with the patient's directions at its ends if known."""
    upper, lower = labels[2 * axis : 2 * axis + 2] or ("", "")
    return f"{'xyz'[axis]} ({lower}–{upper})" if lower else "xyz"[axis]
