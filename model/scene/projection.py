"""Projection of points of a volume into its image, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from model.scene.view import VIEW_ANGLE, View
from model.scene.volume import Triple

NEAREST_DEPTH = 0.01
"""Least distance in front of the eye at which something is seen, in bounding-sphere radii."""

_TANGENT = math.tan(math.radians(VIEW_ANGLE / 2))
_RADIUS = 0.5  # of the bounding sphere, where proportions are lengths relative to its diameter


@dataclass(frozen=True)
class Projection:
    """The camera of a view of a volume, as the renderers have it.

    Points are fractions of the volume's extent along x, y and z. Places in the image are
    to the right and up from its middle, in halves of its shorter side.
    """

    view: View
    proportions: Triple  # the volume's

    @property
    def eye(self) -> NDArray[np.float64]:
        """The camera's position as a point, float64, shape (3,)."""
        back = self.view.basis()[2]
        return 0.5 + self.view.camera_distance(_RADIUS) * back / np.array(self.proportions)

    def depths(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far in front of the eye points (N, 3) lie, in radii, shape (N,)."""
        return self._in_camera(points)[:, 2] / _RADIUS

    def places(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the places of points (N, 3) in the image, shape (N, 2).

        Points must lie in front of the eye, see :meth:`depths`.
        """
        camera = self._in_camera(points)
        return camera[:, :2] / camera[:, 2:] + (self.view.pan_x, self.view.pan_y)

    def seen_part(
        self, start: NDArray[np.float64], end: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Return the ends (2, 3) of the part of a line that is in front of the eye, or None."""
        depths = self.depths(np.stack([start, end])) - NEAREST_DEPTH
        if depths.max() <= 0.0:
            return None
        if depths.min() < 0.0:
            cut = start + (end - start) * depths[0] / (depths[0] - depths[1])
            start, end = (cut, end) if depths[0] < 0.0 else (start, cut)
        return np.stack([start, end])

    def nearest_on(
        self, place: tuple[float, float], start: NDArray[np.float64], end: NDArray[np.float64]
    ) -> float | None:
        """Position along a line whose image is nearest to a place: 0 at the start, 1 at the end.

        None if the line cannot be seen, or only as a point.
        """
        part = self.seen_part(start, end)
        if part is None:
            return None
        first, last = self.places(part)
        along = last - first
        length = float(along @ along)
        if length == 0.0:
            return None
        share = min(max(float((np.array(place) - first) @ along) / length, 0.0), 1.0)
        # In perspective, equal parts of the line are not equally long in the image.
        near, far = self.depths(part)
        share = share * near / (far + share * (near - far))
        point = part[0] + share * (part[1] - part[0])
        axis = int(np.argmax(np.abs(end - start)))
        return float((point[axis] - start[axis]) / (end[axis] - start[axis]))

    def _in_camera(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """To the right and up, in units of which the image has one at depth 1; and the depth."""
        offsets = (points - 0.5) * self.proportions @ self.view.basis().T
        offsets[:, :2] /= _TANGENT
        offsets[:, 2] = self.view.camera_distance(_RADIUS) - offsets[:, 2]
        return offsets


def holding(
    point: NDArray[np.float64], place: NDArray[np.float64], view: View, proportions: Triple
) -> View:
    """Pan a view so that a point is at a place in the image, if it is in front of the eye.

    The point (3,) is in fractions of the volume's extent along x, y and z; the place (2,) is to the
    right and up from the image's middle, in halves of its shorter side.
    """
    projection = Projection(view, proportions)
    if projection.depths(point[None])[0] < NEAREST_DEPTH:
        return view
    right, up = place - projection.places(point[None])[0]
    return replace(view, pan_x=view.pan_x + float(right), pan_y=view.pan_y + float(up))
