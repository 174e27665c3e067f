"""A clipping plane at any angle, and with the crop box the part of a volume that is shown."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.scene.crop import CropBox
from model.scene.volume import Triple, Volume

WHOLE_BOX = CropBox()
CUTS_NOTHING = np.array([0.0, 0.0, 0.0, 1e30])  # as in `ShownPart.plane`


@dataclass(frozen=True)
class ClipPlane:
    """Plane beyond which a volume is cut away: on the side that its normal points to.

    Raises :class:`TfscopeError` for a normal of length 0 and for an offset outside -1 to 1.
    """

    normal: Triple  # along the volume's axes; of length 1, whatever length it is given with
    offset: float = 0.0
    """Distance from the volume's centre along the normal, in halves of the volume's diagonal."""

    def __post_init__(self) -> None:
        length = math.hypot(*self.normal)
        if not (math.isfinite(length) and length > 0):
            raise TfscopeError(
                f"The clipping plane's normal is {self.normal}; give a direction, such as 0,0,1."
            )
        if not -1 <= self.offset <= 1:
            raise TfscopeError(
                f"The clipping plane's offset is {self.offset:g}; give a number from -1 to 1 "
                "(0 cuts through the volume's centre)."
            )
        # Rounding must not change one that was kept.
        if abs(length - 1) > 1e-12:
            x, y, z = (float(number) / length for number in self.normal)
            object.__setattr__(self, "normal", (x, y, z))

    @classmethod
    def parse(cls, text: str) -> ClipPlane:
        """Parse ``"X,Y,Z,OFFSET"``, without an offset 0; raise `TfscopeError` for anything else."""
        try:
            x, y, z, *rest = (float(part) for part in text.split(","))
            (offset,) = rest or (0.0,)
        except ValueError:
            raise TfscopeError(
                f"'{text}' is not a clipping plane; give a direction and an offset from the "
                "centre, x,y,z,offset, for example 1,1,0,0.2."
            ) from None
        return cls((x, y, z), offset)

    @classmethod
    def through(
        cls, point: NDArray[np.float64], normal: NDArray[np.float64], proportions: Triple
    ) -> ClipPlane:
        """Return the plane through a point (3,), in fractions of the volume's lengths."""
        x, y, z = (normal / np.linalg.norm(normal)).tolist()
        offset = -float(cls((x, y, z)).depths(point, proportions))
        return cls((x, y, z), min(max(offset, -1.0), 1.0))

    @property
    def flipped(self) -> ClipPlane:
        """The same plane, which cuts away the other side."""
        x, y, z = self.normal
        return ClipPlane((-x, -y, -z), -self.offset)

    def depths(self, points: NDArray[np.float64], proportions: Triple) -> NDArray[np.float64]:
        """Return how far points (..., 3) lie on the shown side, in halves of the diagonal."""
        return np.asarray(self.offset - (2 * points - 1) * proportions @ np.array(self.normal))

    def nearest(self, point: NDArray[np.float64], proportions: Triple) -> NDArray[np.float64]:
        """Return the point of the plane that is nearest to a point (3,) in fractions."""
        away = self.depths(point, proportions) / 2
        return np.asarray(point + away * np.array(self.normal) / proportions)

    def outline(self, box: CropBox, proportions: Triple) -> NDArray[np.float64]:
        """Return the corners (n, 3) of the plane's part in a box, in turn; none where it misses."""
        corners = np.array(list(itertools.product(*zip(box.low, box.high, strict=True))))
        depths = self.depths(corners, proportions)
        # Edges join corners that differ along one axis.
        edges = [(one, one | bit) for one in range(8) for bit in (1, 2, 4) if not one & bit]
        cut = [edge for edge in edges if (depths[edge[0]] < 0) != (depths[edge[1]] < 0)]
        one, other = np.array(cut, int).reshape(-1, 2).T
        share = depths[one] / (depths[one] - depths[other])
        points = corners[one] + share[:, None] * (corners[other] - corners[one])
        across = (points - points.sum(axis=0) / max(len(points), 1)) * proportions
        # Any direction in the plane.
        first = np.cross(self.normal, np.eye(3)[np.argmin(np.abs(self.normal))])
        angles = np.arctan2(across @ np.cross(self.normal, first), across @ first)
        return points[np.argsort(angles)]

    def numbers(self) -> NDArray[np.float64]:
        """Return normal and offset as an array (4,)."""
        return np.array([*self.normal, self.offset])


@dataclass(frozen=True)
class ShownPart:
    """The part of a volume that a crop box and a clipping plane leave."""

    crop: CropBox = WHOLE_BOX
    clip: ClipPlane | None = None

    @property
    def is_whole(self) -> bool:
        """Whether nothing is left out."""
        return self.clip is None and self.crop.is_whole

    def corners(self, volume: Volume) -> NDArray[np.float64]:
        """Return the crop box's least and greatest corner (2, 3) in voxels."""
        return np.array([self.crop.low, self.crop.high]) * (np.array(volume.dimensions) - 1)

    def plane(self, volume: Volume) -> NDArray[np.float64]:
        """Return the clipping plane in voxels: a normal (3) of length 1, and its level.

        A place is shown where the normal's product with it is at most the level; the difference is
        the place's depth in voxels.
        """
        if self.clip is None:
            return CUTS_NOTHING
        normal = np.array(self.clip.normal)
        level = normal @ volume.extent / 2 + self.clip.offset * volume.radius
        across = normal * volume.spacing
        return np.array([*across, level]) / np.linalg.norm(across)

    @property
    def normal(self) -> Triple:
        """The clipping plane's normal in the world; 0 without one."""
        return (0.0, 0.0, 0.0) if self.clip is None else self.clip.normal


WHOLE_PART = ShownPart()
