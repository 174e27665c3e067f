"""Upright views of a volume about any axis, and the home view."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from model.errors import TfscopeError
from model.scene.crop import CropBox
from model.scene.region import SQUARE, Reach
from model.scene.view import (
    AXES,
    DEFAULT_UP,
    FAR_DISTANCE_RADII,
    VIEW_ANGLE,
    Projection,
    View,
    axis_direction,
    holding,
    upright_frame,
)
from model.scene.volume import Triple

FACING = (0.0, 30.0, -30.0)  # azimuths if a file defines the front, the usual one first
AROUND = (30.0, -30.0, 60.0, 0.0, -60.0)  # azimuths of other volumes, the usual one first
ELEVATIONS = (15.0, 35.0)  # the usual elevation, and that of flat slabs
SLAB = 0.65  # largest height of a flat slab, as a share of its mean width
WORTH = 1.3  # factor by which an unusual view must show more
NEARLY = 0.9  # share of the best view's area with which a more usual one is preferred
OUTLINE = 32  # tangents that approximate an outline


def home_angles(offsets: NDArray[np.float64], up: str, front: str = "") -> tuple[float, float]:
    """Azimuth and elevation of the usual view, or of one nearby that shows much more.

    The offsets (n, 3) surround the shown part, in lengths along x, y and z. Flat slabs are seen
    from farther above. The area within the outline is compared, without perspective.
    """
    turned = offsets @ upright_frame(up, front).T
    azimuths = FACING if front else AROUND
    across, depth, height = np.ptp(turned, axis=0)
    elevations = ELEVATIONS[1:] if height <= SLAB * (across + depth) / 2 else ELEVATIONS
    candidates = [(azimuth, elevation) for elevation in elevations for azimuth in azimuths]
    areas = [_outlined_area(turned @ View(*angles).basis()[:2].T) for angles in candidates]
    most = max(areas)
    if most <= WORTH * areas[0]:
        return candidates[0]
    return next(c for c, area in zip(candidates, areas, strict=True) if area >= NEARLY * most)


def _outlined_area(places: NDArray[np.float64]) -> float:
    """Area of the polygon around points (n, 2) with sides in evenly spaced directions."""
    step = 2 * math.pi / OUTLINE
    directions = step * np.arange(OUTLINE)
    heights = (places @ np.stack([np.cos(directions), np.sin(directions)])).max(axis=0)
    around = np.roll(heights, 1) + np.roll(heights, -1)
    sides = (around - 2 * math.cos(step) * heights) / math.sin(step)
    return float(heights @ sides) / 2


STANDARD_VIEWS = {
    "Front": (0.0, 0.0), "Back": (180.0, 0.0), "Left": (270.0, 0.0), "Right": (90.0, 0.0),
    "Top": (0.0, 90.0), "Bottom": (0.0, -90.0),
}  # fmt: skip
"""Azimuth and elevation of each view; left and right are the viewer's."""

NEAREST_HOME, FARTHEST_HOME = 0.4, 1.0  # limits of home views that generators are trained for
NEAREST, FARTHEST = 0.05, 1.5  # limits of the home view's distance elsewhere


def corners(box: CropBox) -> NDArray[np.float64]:
    """Return the corners of a box as fractions of the volume's lengths, shape (8, 3)."""
    return np.array(list(itertools.product(*zip(box.low, box.high, strict=True))))


WHOLE = corners(CropBox())  # corners of a volume: with these, all of it is in the image
HALVINGS = 20  # bisections in the search for the nearest distance that fits
MARGIN = 0.05  # free share of half the image's side around a volume that just fits
FILLED = 0.85  # share of an image's height that the shown part fills in the home view

LINE, LINE_WIDTH = 200.0, 0.1
"""Least ratio of the longest to the next side of a volume that is a line. The home view shows its
middle, with this width as a share of the image's height."""

CLOSEST = 0.1  # least distance of the shown part in the home view, in bounding-sphere radii


@cache
def faces(up: str, front: str = "") -> Mapping[str, str]:
    """Return the axis that faces the camera in each of :data:`STANDARD_VIEWS`."""
    frame = upright_frame(up, front)
    backs = {name: View(*angles).basis()[2] @ frame for name, angles in STANDARD_VIEWS.items()}
    directions = np.array([axis_direction(axis) for axis in AXES])
    return {name: AXES[int((directions @ back).argmax())] for name, back in backs.items()}


FROM_AFAR = View()


def view_in(
    up: str,
    azimuth: float,
    elevation: float,
    roll: float = 0.0,
    view: View = FROM_AFAR,
    *,
    front: str = "",
) -> View:
    """Turn a view to these angles about an up axis; for ``"+z"``, exactly these numbers."""
    turned = replace(view, azimuth=azimuth, elevation=elevation, roll=roll)
    return turned.in_frame(upright_frame(up, front).T)


def angles_in(up: str, view: View, *, front: str = "") -> tuple[float, float, float]:
    """Azimuth, elevation and roll of a view about an up axis; the inverse of :func:`view_in`."""
    view = view.in_frame(upright_frame(up, front))
    return view.azimuth, view.elevation, view.roll


def fit_distance(
    proportions: Triple,
    view: View | NDArray[np.float64],
    points: NDArray[np.float64] = WHOLE,
    reach: Reach = SQUARE,
) -> float:
    """Smallest distance, in a view's units, at which points of the volume are in the image.

    Only the axes of the view, or its basis (3, 3), matter. The points (n, 3) are fractions of the
    volume's lengths along x, y and z.
    """
    basis = view.basis() if isinstance(view, View) else view
    right, up, back = basis @ _in_radii(points, proportions).T
    tangent = (1.0 - MARGIN) * View.tangent
    across, along = np.abs(right) / (2 * reach[0]), np.abs(up) / (2 * reach[1])
    if isinstance(view, View) and view.is_orthographic:
        back = np.zeros_like(back)
    needed = back + np.maximum(across, along) / tangent
    return float(needed.max()) / FAR_DISTANCE_RADII


def home_view(
    proportions: Triple,
    up: str = DEFAULT_UP,
    *,
    front: str = "",
    points: NDArray[np.float64] = WHOLE,
    reach: Reach = SQUARE,
    angles: tuple[float, float] | None = None,
) -> View:
    """Initial view of a volume: upright, with its shown part as high as the image allows.

    It fills :data:`FILLED` of the image's height, or the width up to :data:`MARGIN`. It is centred
    except in a square image: models, which draw these, have no panned views. The points (n, 3)
    surround the shown part; the default angles are :func:`home_angles`.
    """
    angles = angles or home_angles(_in_radii(points, proportions), up, front)
    view = view_in(up, *angles, front=front)
    if reach != SQUARE or line_distance(proportions) is not None:
        return centred(replace(view, distance=FARTHEST), proportions, points, reach)
    whole = fit_distance(proportions, view, points=points)
    distance = max(whole, _nearest(view, proportions, points, reach, whole))
    return replace(view, distance=min(max(distance, NEAREST_HOME), FARTHEST_HOME))


def line_distance(lengths: Sequence[float]) -> float | None:
    """Distance from which a line-like volume has some width; None for others."""
    _, middle, longest = sorted(lengths)
    if longest < LINE * middle:
        return None
    return middle / math.hypot(*lengths) / LINE_WIDTH * math.cos(math.radians(VIEW_ANGLE / 2))


def centred(
    view: View, proportions: Triple, points: NDArray[np.float64] = WHOLE, reach: Reach = SQUARE
) -> View:
    """Pan a view to the middle of some points, at most as near as the home view."""
    if (nearby := line_distance(proportions)) is not None:
        return replace(view, distance=nearby)
    distance = _nearest(view, proportions, points, reach, view.distance)
    return panned_to(replace(view, distance=distance), proportions, points)


def panned_to(view: View, proportions: Triple, points: NDArray[np.float64] = WHOLE) -> View:
    """Pan a view to the middle of some points."""
    low, high = _ends(view, proportions, points, view.distance)
    pan_x, pan_y = map(float, -(low + high) / 2)
    return replace(view, pan_x=pan_x, pan_y=pan_y)


def _nearest(
    view: View, proportions: Triple, points: NDArray[np.float64], reach: Reach, farthest: float
) -> float:
    """Smallest distance at which points take no more of the image than in the home view."""
    room = 2 * np.array(reach) * (1.0 - MARGIN, FILLED)
    back = view.basis()[2] @ _in_radii(points, proportions).T
    # Nearer, some of them would be level with or behind the camera.
    nearest = 0.0 if view.is_orthographic else (float(back.max()) + CLOSEST) / FAR_DISTANCE_RADII
    near = min(max(NEAREST, nearest), farthest)
    distance = farthest
    for _ in range(HALVINGS):
        low, high = _ends(view, proportions, points, (near + distance) / 2)
        if ((high - low) / 2 <= room).all():
            distance = (near + distance) / 2
        else:
            near = (near + distance) / 2
    return distance


def _ends(
    view: View, proportions: Triple, points: NDArray[np.float64], distance: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower left and upper right corner of points in the image, in halves of its shorter side."""
    centred = replace(view, distance=distance, pan_x=0.0, pan_y=0.0)
    places = Projection(centred, proportions).places(points)
    return places.min(axis=0), places.max(axis=0)


def _in_radii(points: NDArray[np.float64], proportions: Triple) -> NDArray[np.float64]:
    """Offsets from the volume's centre in units of its bounding sphere's radius."""
    # Whose diameter is 1 in the proportions.
    return np.asarray((2.0 * points - 1.0) * proportions)


def standard_view(name: str, view: View, up: str, *, front: str = "") -> View:
    """Turn a view to one of :data:`STANDARD_VIEWS`, centred; others are a `TfscopeError`."""
    if name not in STANDARD_VIEWS:
        raise TfscopeError(f"'{name}' is not a view; give one of {', '.join(STANDARD_VIEWS)}.")
    azimuth, elevation = STANDARD_VIEWS[name]
    return view_in(up, azimuth, elevation, 0.0, replace(view, pan_x=0.0, pan_y=0.0), front=front)


def turntable(
    view: View, count: int, up: str, proportions: Triple, pivot: Triple = (0.5, 0.5, 0.5)
) -> list[View]:
    """Return the views of one turn, in which the volume seems to turn to the right.

    The last view is a step before the first, so that the movie loops smoothly. The pivot, in
    fractions of the volume's lengths, keeps its place in the image.
    """
    azimuth, elevation, roll = angles_in(up, view)
    point = np.array(pivot)
    place = Projection(view, proportions).places(point[None])[0]
    views = [view]
    for number in range(1, count):
        turned = view_in(up, (azimuth - 360 * number / count) % 360, elevation, roll, view)
        views.append(holding(point, place, turned, proportions))
    return views
