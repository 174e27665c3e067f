"""A volume's axes by name, and the frame in which one of them points up."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from model.errors import ViewError

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Names of a volume's axes, with their sign."""

DEFAULT_UP = "+z"

_USUAL_FRONTS = {"+x": "-y", "-x": "-y", "+y": "+z", "-y": "-z", "+z": "-y", "-z": "-y"}


def axis_labelled(label: str, labels: tuple[str, ...]) -> str:
    """Return the axis with a label, given one label for each of :data:`AXES`; empty if none."""
    return next((axis for axis, each in zip(AXES, labels, strict=False) if each == label), "")


def axis_direction(axis: str) -> NDArray[np.float64]:
    """Unit vector of an axis such as ``"-y"``, shape (3,).

    Raises
    ------
    ViewError
        When the text is not one of :data:`AXES`.
    """
    if axis not in AXES:
        raise ViewError(f"'{axis}' is not an axis; give one of {', '.join(AXES)}.")
    direction = np.zeros(3)
    direction["xyz".index(axis[1])] = 1.0 if axis[0] == "+" else -1.0
    return direction


@cache
def upright_frame(up: str, front: str = "") -> NDArray[np.float64]:
    """Axes in which the volume stands upright.

    Parameters
    ----------
    up : str
        The volume's axis that points up, one of :data:`AXES`.
    front : str
        The axis that faces the camera at azimuth 0; where it is empty or along the up
        axis, a usual one.

    Returns
    -------
    ndarray of float64, shape (3, 3)
        Rows are the upright frame's x, y and z in volume coordinates, determinant 1; the
        identity for ``"+z"``.
    """
    z = axis_direction(up)
    if not front or front[1:] == up[1:]:
        front = _USUAL_FRONTS[up]
    y = -axis_direction(front)
    # Adding 0 turns -0 to 0.
    frame = np.stack([np.cross(y, z), y, z]) + 0.0
    # Each move of the mouse asks for it several times.
    frame.flags.writeable = False
    return frame
