"""Upright views of a volume, whichever of its axes points up, and the view with all of it.

A :class:`View` always turns about the volume's z axis. Here, views are given by angles
about another axis of the volume, which is called its up axis.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from model.errors import ViewError
from model.scene.axes import AXES, DEFAULT_UP, axis_direction, upright_frame
from model.scene.crop import CropBox
from model.scene.region import SQUARE, Reach
from model.scene.view import FAR_DISTANCE_RADII, VIEW_ANGLE, View

STANDARD_VIEWS = {
    "Front": (0.0, 0.0),
    "Back": (180.0, 0.0),
    "Left": (270.0, 0.0),
    "Right": (90.0, 0.0),
    "Top": (0.0, 90.0),
    "Bottom": (0.0, -90.0),
}
"""Azimuth and elevation of each view; left and right are the viewer's."""

HOME_AZIMUTH, HOME_ELEVATION = 30.0, 15.0
NEAREST_HOME, FARTHEST_HOME = 0.4, 1.0
"""Limits of the home view's distance: what generators are trained for, and the whole volume."""

WHOLE = CropBox()
"""All of a volume."""

MARGIN = 0.03
"""Part of half the image's side that is left free around a volume that just fits."""


def faces(up: str, front: str = "") -> dict[str, str]:
    """Return the axis that faces the camera in each of :data:`STANDARD_VIEWS`."""
    frame = upright_frame(up, front)
    backs = {name: View(*angles).basis()[2] @ frame for name, angles in STANDARD_VIEWS.items()}
    return {name: _nearest_axis(back) for name, back in backs.items()}


def view_in(
    up: str,
    azimuth: float,
    elevation: float,
    roll: float = 0.0,
    distance: float = 1.0,
    pan_x: float = 0.0,
    pan_y: float = 0.0,
    *,
    front: str = "",
) -> View:
    """Return the view with these angles about an up axis; for ``"+z"``, exactly these numbers.

    Parameters
    ----------
    up, front : str
        See :func:`upright_frame`.
    azimuth, elevation, roll, distance, pan_x, pan_y : float
        As a :class:`View`'s.
    """
    view = View(azimuth, elevation, roll, distance, pan_x, pan_y)
    return view.in_frame(upright_frame(up, front).T)


def angles_in(up: str, view: View, *, front: str = "") -> tuple[float, float, float]:
    """Azimuth, elevation and roll of a view about an up axis; the inverse of :func:`view_in`."""
    view = view.in_frame(upright_frame(up, front))
    return view.azimuth, view.elevation, view.roll


def fit_distance(
    proportions: tuple[float, float, float],
    view: View | NDArray[np.float64],
    margin: float = MARGIN,
    box: CropBox = WHOLE,
    reach: Reach = SQUARE,
) -> float:
    """Smallest distance at which a box of the volume lies inside the image.

    Parameters
    ----------
    proportions : tuple of float
        A volume's `proportions`.
    view : View or ndarray of float64, shape (3, 3)
        Only its axes matter: rows right, up and back.
    margin : float
        Part of half the image's side that is left free.
    box : CropBox
        Part of the volume; by default, all of it. The view is aimed at the volume's centre.
    reach : tuple of float
        The image's, see :data:`model.scene.region.Reach`; by default a square one's.

    Returns
    -------
    float
        In a view's units; up to 1 without a margin.
    """
    basis = view.basis() if isinstance(view, View) else view
    # In units of the bounding sphere's radius, as its diameter is 1.
    sides = zip(box.low, box.high, strict=True)
    corners = (2.0 * np.array(list(itertools.product(*sides))) - 1.0) * proportions
    right, up, back = basis @ corners.T
    tangent = (1.0 - margin) * math.tan(math.radians(VIEW_ANGLE / 2))
    across, along = np.abs(right) / (2 * reach[0]), np.abs(up) / (2 * reach[1])
    needed = back + np.maximum(across, along) / tangent
    return float(needed.max()) / FAR_DISTANCE_RADII


def home_view(
    proportions: tuple[float, float, float],
    up: str = DEFAULT_UP,
    *,
    front: str = "",
    box: CropBox = WHOLE,
    reach: Reach = SQUARE,
) -> View:
    """Initial view of a volume: upright, from above and the side, with a box in the image.

    Parameters
    ----------
    proportions : tuple of float
        The volume's.
    up, front : str
        See :func:`upright_frame`.
    box : CropBox
        Part of the volume that must be in the image; by default, all of it.
    reach : tuple of float
        The image's, see :func:`fit_distance`.
    """
    view = view_in(up, HOME_AZIMUTH, HOME_ELEVATION, front=front)
    distance = fit_distance(proportions, view, box=box, reach=reach)
    return replace(view, distance=min(max(distance, NEAREST_HOME), FARTHEST_HOME))


def standard_view(name: str, distance: float, up: str, *, front: str = "") -> View:
    """Return one of :data:`STANDARD_VIEWS`, in the middle of the image.

    Raises
    ------
    ViewError
        When there is no such view.
    """
    if name not in STANDARD_VIEWS:
        raise ViewError(f"'{name}' is not a view; give one of {', '.join(STANDARD_VIEWS)}.")
    azimuth, elevation = STANDARD_VIEWS[name]
    return view_in(up, azimuth, elevation, distance=distance, front=front)


def _nearest_axis(direction: NDArray[np.float64]) -> str:
    return max(AXES, key=lambda axis: float(axis_direction(axis) @ direction))
