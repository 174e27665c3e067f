"""Steps of the view: orbit, turn freely, roll, pan and zoom.

Mouse and keyboard make them, see :mod:`app.image_view.gestures` and
:mod:`app.image_view.view_keys`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from app.state.view_navigation import ViewNavigation
from model.scene.orientation import angles_in, view_in
from model.scene.view import DEFAULT_UP, View

DEGREES_PER_PIXEL = 0.4
ZOOM_PER_NOTCH = 0.92
NEAREST, FARTHEST = 0.25, 1.5
"""Limits of the distance for zooming."""


def orbit(view: View, dx: float, dy: float, up: str = DEFAULT_UP) -> View:
    """Return the view after orbiting the volume by a mouse movement in pixels, right and down.

    It turns about the up axis, whose poles are a limit.
    """
    azimuth, elevation, turned = angles_in(up, view)
    sin_r, cos_r = math.sin(math.radians(turned)), math.cos(math.radians(turned))
    across = dx * cos_r + dy * sin_r
    down = dy * cos_r - dx * sin_r
    return view_in(
        up,
        (azimuth - DEGREES_PER_PIXEL * across) % 360.0,
        min(max(elevation + DEGREES_PER_PIXEL * down, -90.0), 90.0),
        turned,
        view.distance,
        view.pan_x,
        view.pan_y,
    )


def tumble(view: View, dx: float, dy: float) -> View:
    """Return the view after turning the volume freely about the image's own axes.

    The movement of the mouse is in pixels, to the right and down.
    """
    length = math.hypot(dx, dy)
    if length == 0.0:
        return view
    angle = math.radians(DEGREES_PER_PIXEL * length)
    # Rodrigues' formula, in the camera's right, up and back.
    x, y = dy / length, dx / length
    cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)
    return View.of_basis(turn @ view.basis(), view.distance, view.pan_x, view.pan_y)


def turn(state: ViewNavigation, dx: float, dy: float) -> View:
    """Return the state's view after a mouse movement in pixels, in the way that it turns."""
    if state.trackball:
        return state.turned(tumble(state.view, dx, dy))
    return state.turned(orbit(state.view, dx, dy, state.up_axis))


def roll(view: View, degrees: float) -> View:
    """Return the view with the image turned clockwise; the roll stays in -180..180."""
    return replace(view, roll=(view.roll + degrees + 180.0) % 360.0 - 180.0)


def pan(view: View, right: float, up: float) -> View:
    """Return the view with the picture moved, in halves of the image's shorter side."""
    return replace(view, pan_x=view.pan_x + right, pan_y=view.pan_y + up)


def zoom(view: View, notches: float, at: tuple[float, float] = (0.0, 0.0)) -> View:
    """Return the view moved closer by wheel notches, within the limits.

    What is at a place in the plane through the volume's centre stays there: to the right and up
    from the image's middle, in halves of its shorter side.
    """
    distance = min(max(view.distance * ZOOM_PER_NOTCH**notches, NEAREST), FARTHEST)
    grown = view.distance / distance
    (x, y), pan_x, pan_y = at, view.pan_x, view.pan_y
    return replace(
        view,
        distance=distance,
        pan_x=x + (pan_x - x) * grown,
        pan_y=y + (pan_y - y) * grown,
    )


def notches_of(scale: float) -> float:
    """Return the wheel notches that enlarge the picture by a factor above 0."""
    return -math.log(scale) / math.log(ZOOM_PER_NOTCH)
