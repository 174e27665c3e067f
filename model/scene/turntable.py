"""Views of a full turn about the volume's up axis."""

from __future__ import annotations

import numpy as np

from model.scene.orientation import angles_in, view_in
from model.scene.projection import Projection, holding
from model.scene.view import View
from model.scene.volume import Triple

MIDDLE = (0.5, 0.5, 0.5)


def turntable(
    view: View, count: int, up: str, proportions: Triple, pivot: Triple = MIDDLE
) -> list[View]:
    """Return the views of one turn, in which what is shown seems to turn to the right.

    The last one is a step before the first, so that the movie can be repeated without a stop.

    Parameters
    ----------
    view : View
        The first one.
    count : int
        Number of views.
    up : str
        Axis of the volume that they turn about, such as ``"+z"``.
    proportions : tuple of float
        The volume's.
    pivot : tuple of float
        Point that keeps its place in the image, in fractions of the volume's lengths.
    """
    azimuth, elevation, roll = angles_in(up, view)
    point = np.array(pivot)
    place = Projection(view, proportions).places(point[None])[0]
    views = [view]
    for number in range(1, count):
        turned = view_in(
            up,
            (azimuth - 360 * number / count) % 360,
            elevation,
            roll,
            view.distance,
            view.pan_x,
            view.pan_y,
        )
        views.append(holding(point, place, turned, proportions))
    return views
