"""The view: its numbers, camera and upright frames, and projection of points.

Every renderer takes its camera from :meth:`View.basis`, which is computed in closed form, without a
cross product with an "up" vector, and is therefore not degenerate at the poles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from functools import cache, lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.scene.volume import Triple

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")  # names of a volume's axes, with their sign
DEFAULT_UP = "+z"

_USUAL_FRONTS = {"+x": "-y", "-x": "-y", "+y": "+z", "-y": "-z", "+z": "-y", "-z": "-y"}


def axis_labelled(label: str, labels: tuple[str, ...]) -> str:
    """Return the axis with a label, given one label for each of :data:`AXES`; empty if none."""
    return next((axis for axis, each in zip(AXES, labels, strict=False) if each == label), "")


def axis_direction(axis: str) -> NDArray[np.float64]:
    """Unit vector (3,) of one of :data:`AXES`; other names are a :class:`TfscopeError`."""
    if axis not in AXES:
        raise TfscopeError(f"'{axis}' is not an axis; give one of {', '.join(AXES)}.")
    direction = np.zeros(3)
    direction["xyz".index(axis[1])] = 1.0 if axis[0] == "+" else -1.0
    return direction


@cache
def upright_frame(up: str, front: str = "") -> NDArray[np.float64]:
    """Axes (3, 3) in which the volume stands upright; the identity for ``"+z"``."""
    z = axis_direction(up)
    if not front or front[1:] == up[1:]:
        front = _USUAL_FRONTS[up]
    y = -axis_direction(front)
    # Adding 0 turns -0 to 0.
    frame = np.stack([np.cross(y, z), y, z]) + 0.0
    # Called several times for each move of the mouse.
    frame.flags.writeable = False
    return frame


VIEW_PARAMETERS = 5  # number of view parameters in network inputs, see `vector`
VIEW_ANGLE = 30.0  # full vertical angle of the perspective camera, in degrees

FAR_DISTANCE_RADII = 1.0 / math.sin(math.radians(VIEW_ANGLE / 2))
"""Camera distance, in bounding-sphere radii, at which the sphere just fills the image.

View distances are given in this unit: at distance 1 the whole volume is in
view from every direction.
"""

ORTHOGRAPHIC = "orthographic"  # follows the numbers of such a view as text

_POLE = 1e-9
_DECIMALS = 10
_IDENTITY = np.eye(3)


@dataclass(frozen=True)
class ViewRange:
    """Range of views that generators are trained for."""

    max_elevation: float = 80.0  # elevations run over +- this angle, in degrees
    max_roll: float = 10.0  # rolls run over +- this angle, in degrees
    nearest: float = 0.4  # limits of the distance; at 1 the whole volume is in view
    farthest: float = 1.0
    up: str = DEFAULT_UP
    """The volume's axis of the angles, one of :data:`model.scene.view.AXES`: without roll, it
    points up in every image."""

    def __post_init__(self) -> None:
        axis_direction(self.up)
        for name in ("max_elevation", "max_roll", "nearest", "farthest"):
            value = getattr(self, name)
            if not (isinstance(value, int | float) and math.isfinite(value) and value > 0):
                raise TfscopeError(f"The view range's {name} is {value!r}; give a number above 0.")
        if self.max_elevation > 90 or self.nearest >= self.farthest:
            raise TfscopeError(
                "The view range must end at an elevation of at most 90 degrees, "
                "and its nearest distance must be smaller than its farthest."
            )


@dataclass(frozen=True)
class View:
    """Position and roll of a camera that looks at the volume's centre.

    At azimuth 0 and elevation 0 the camera is on the negative y axis with z up (for a CT in patient
    coordinates, it faces the patient). Raises :class:`TfscopeError` for values that are not finite
    or out of range.
    """

    tangent: ClassVar[float] = math.tan(math.radians(VIEW_ANGLE / 2))  # of half the view angle
    azimuth: float = 0.0  # rotation about the z axis, degrees, any finite value; 360 equals 0
    elevation: float = 0.0  # angle above the xy plane, degrees, -90..90
    roll: float = 0.0
    """Rotation about the line of sight, degrees; positive turns the camera counter-clockwise, so
    that the image turns clockwise."""
    distance: float = 1.0
    """Distance to the centre in units of the distance at which the volume's bounding sphere just
    fills the image; > 0."""
    pan_x: float = 0.0
    pan_y: float = 0.0
    """Position of the volume's centre in the image, to the right and up from its middle, in halves
    of the image's shorter side. The image is shifted without turning the camera."""
    is_orthographic: bool = field(default=False, kw_only=True)
    """Whether all rays are parallel. The plane through the volume's centre has the same size as in
    the perspective view from this distance, and nothing of the volume is in front of the eye."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not math.isfinite(value):
                raise TfscopeError(f"The view's {name} is {value}; give a finite number.")
        if not -90.0 <= self.elevation <= 90.0:
            raise TfscopeError(
                f"The view's elevation is {self.elevation:g}; give degrees from -90 to 90."
            )
        if self.distance <= 0.0:
            raise TfscopeError(
                f"The view's distance is {self.distance:g}; give a number above 0 "
                "(1 has the whole volume in view)."
            )

    @classmethod
    def parse(cls, text: str) -> View:
        """Parse ``"AZ,EL,ROLL,DIST,X,Y"``; trailing numbers may be left out for their defaults.

        The word ``orthographic`` may follow. Raises :class:`TfscopeError` for anything else.
        """
        parts = [part.strip() for part in text.split(",")]
        is_orthographic = parts[-1] == ORTHOGRAPHIC
        try:
            numbers = [float(part) for part in parts[: len(parts) - is_orthographic]]
        except ValueError:
            numbers = []
        if not 1 <= len(numbers) < len(fields(cls)):
            raise TfscopeError(
                f"'{text}' is not a view; give azimuth,elevation,roll,distance "
                "and, to move the picture off the centre, x,y: for example 30,20,0,1; "
                f"or 30,20,0,1,{ORTHOGRAPHIC}."
            )
        return cls(*numbers, is_orthographic=is_orthographic)

    def basis(self) -> NDArray[np.float64]:
        """Camera axes (3, 3) as rows: right, up and back, orthonormal, in volume coordinates."""
        return _basis(self.azimuth, self.elevation, self.roll).copy()

    def with_basis(self, basis: NDArray[np.float64]) -> View:
        """Return this view with other camera axes (3, 3); the inverse of :meth:`basis`.

        Angles are rounded to 1e-10 degrees, so that upright views have round numbers. At a pole,
        where only azimuth and roll together are defined, the roll is 0.
        """
        right, _, back = basis
        level = math.hypot(back[0], back[1])
        elevation = math.degrees(math.atan2(back[2], level))
        if level < _POLE:
            elevation = math.copysign(90.0, back[2])
            azimuth, roll = math.degrees(math.atan2(right[1], right[0])), 0.0
        else:
            azimuth = math.degrees(math.atan2(back[0], -back[1]))
            level_right, level_up, _ = View(azimuth, elevation).basis()
            roll = math.degrees(math.atan2(right @ level_up, right @ level_right))
        return replace(
            self,
            # The second remainder is for angles that are rounded to 360.
            azimuth=round(azimuth % 360.0, _DECIMALS) % 360.0,
            elevation=round(elevation, _DECIMALS) + 0.0,
            roll=round(roll, _DECIMALS) + 0.0,
        )

    def in_frame(self, frame: NDArray[np.float64]) -> View:
        """Return this view of the same image, with angles about the z axis of another frame."""
        return self if (frame == _IDENTITY).all() else self.with_basis(self.basis() @ frame.T)

    def camera_distance(self, radius: float) -> float:
        """Distance at which a perspective camera sees it at the same size, by radius."""
        return self.distance * FAR_DISTANCE_RADII * radius

    def eye_distance(self, radius: float) -> float:
        """Distance from the centre to the eye for a bounding sphere of this radius."""
        return 2.0 * radius if self.is_orthographic else self.camera_distance(radius)

    def near_distance(self, radius: float) -> float:
        """Distance from the eye to the near clipping plane."""
        return max(self.eye_distance(radius) - 1.01 * radius, 0.01 * radius)

    def half_sides(self, depths: NDArray[np.float64], radius: float = 1.0) -> NDArray[np.float64]:
        """Length of half the image's shorter side at some distances in front of the eye."""
        centre = np.full_like(depths, self.camera_distance(radius))
        return self.tangent * (centre if self.is_orthographic else depths)

    def vector(self, view_range: ViewRange) -> NDArray[np.float32]:
        """Encode the view for the networks (paper, section 4), shape (5,).

        Elevation, cos azimuth, sin azimuth and roll about the range's up axis, and distance, each
        in [-1, 1] over `view_range`. Views outside are not clipped.
        """
        view = self.in_frame(upright_frame(view_range.up))
        sin_a, cos_a = _sin_cos(view.azimuth)
        middle = (view_range.farthest + view_range.nearest) / 2
        half = (view_range.farthest - view_range.nearest) / 2
        return np.array(
            [
                view.elevation / view_range.max_elevation,
                cos_a,
                sin_a,
                view.roll / view_range.max_roll,
                (view.distance - middle) / half,
            ],
            dtype=np.float32,
        )


# Each move of the mouse asks for it several times.
@lru_cache(maxsize=64)
def _basis(azimuth: float, elevation: float, roll: float) -> NDArray[np.float64]:
    sin_a, cos_a = _sin_cos(azimuth)
    sin_e, cos_e = _sin_cos(elevation)
    sin_r, cos_r = _sin_cos(roll)
    right = np.array([cos_a, sin_a, 0.0])
    up = np.array([-sin_e * sin_a, sin_e * cos_a, cos_e])
    back = np.array([cos_e * sin_a, -cos_e * cos_a, sin_e])
    return np.stack([cos_r * right + sin_r * up, cos_r * up - sin_r * right, back])


def _sin_cos(degrees: float) -> tuple[float, float]:
    """Sine and cosine of an angle in degrees, bitwise equal for angles 360 degrees apart."""
    angle = math.radians(degrees % 360.0)
    return math.sin(angle), math.cos(angle)


NEAREST_DEPTH = 0.01  # nearest visible distance in front of the eye, in bounding-sphere radii

_RADIUS = 0.5  # of the bounding sphere, where proportions are lengths relative to its diameter


def from_middle(place: tuple[float, float]) -> tuple[float, float]:
    """Convert a position in an image, as fractions of its square to the right and down.

    The result is to the right and up from its middle, in halves of the square, as projections are.
    """
    x, y = place
    return 2 * x - 1, 1 - 2 * y


@dataclass(frozen=True)
class Projection:
    """The camera of a view of a volume, as in the renderers.

    Points are fractions of the volume's extent along x, y and z. Image positions are to the right
    and up from the middle, in halves of the shorter side.
    """

    view: View
    proportions: Triple  # the volume's

    @property
    def eye(self) -> NDArray[np.float64]:
        """The camera's position as a point, float64, shape (3,); one of an orthographic view."""
        back = self.view.basis()[2]
        return 0.5 + self.view.eye_distance(_RADIUS) * back / np.array(self.proportions)

    def depths(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far in front of the eye points (N, 3) lie, in radii, shape (N,)."""
        return self._in_camera(points)[:, 2] / _RADIUS

    def places(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the image positions of points (N, 3), shape (N, 2)."""
        camera = self._in_camera(points)
        halves = self.view.half_sides(camera[:, 2:], _RADIUS)
        return camera[:, :2] / halves + (self.view.pan_x, self.view.pan_y)

    def half_sides(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return half the image's side at the depth of points, in radii, shape (N,)."""
        return self.view.half_sides(self.depths(points))

    def sight(self, point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Direction (3,) of the ray through a point, of length 1, along the volume's axes."""
        if self.view.is_orthographic:
            return -self.view.basis()[2]
        ray = (point - self.eye) * self.proportions
        return np.asarray(ray / np.linalg.norm(ray))

    def points(
        self, places: NDArray[np.float64], distances: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the points (..., 3) at image positions (..., 2) and distances (...) in radii."""
        right, up, back = self.view.basis()
        x, y = np.moveaxis(View.tangent * (places - (self.view.pan_x, self.view.pan_y)), -1, 0)
        across = x[..., None] * right + y[..., None] * up
        if self.view.is_orthographic:
            starts, rays = self.view.camera_distance(_RADIUS) * across, -back
        else:
            starts, rays = np.zeros(3), across - back
        along = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
        offsets = starts + _RADIUS * distances[..., None] * along
        return np.asarray(self.eye + offsets / self.proportions)

    def distances(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances from the eye of points (N, 3), in radii, shape (N,)."""
        camera = self._in_camera(points)
        whole = camera[:, 2] if self.view.is_orthographic else np.linalg.norm(camera, axis=1)
        return np.asarray(whole / _RADIUS)

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
        """Position (0..1) on a line nearest to an image position; None if it is no visible line."""
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
        near, far = self.half_sides(part)
        share = share * near / (far + share * (near - far))
        point = part[0] + share * (part[1] - part[0])
        axis = int(np.argmax(np.abs(end - start)))
        return float((point[axis] - start[axis]) / (end[axis] - start[axis]))

    def _in_camera(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return places to the right, up and in front of the eye, in diagonals."""
        offsets = (points - 0.5) * self.proportions @ self.view.basis().T
        offsets[:, 2] = self.view.eye_distance(_RADIUS) - offsets[:, 2]
        return offsets


def holding(
    point: NDArray[np.float64], place: NDArray[np.float64], view: View, proportions: Triple
) -> View:
    """Pan a view to bring a point to an image position, if it is in front of the eye.

    The point (3,) is in fractions of the volume's extent; the position (2,) is to the right and up
    from the image's middle, in halves of its shorter side.
    """
    projection = Projection(view, proportions)
    if projection.depths(point[None])[0] < NEAREST_DEPTH:
        return view
    right, up = place - projection.places(point[None])[0]
    return replace(view, pan_x=view.pan_x + float(right), pan_y=view.pan_y + float(up))
