"""The camera as an array of numbers, for the construction of rays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from model.scene.view import VIEW_ANGLE, View
from model.scene.volume import Geometry


def camera_array(view: View, volume: Geometry) -> NDArray[np.float64]:
    """Return the camera of a view, for :func:`model.rendering.raycast.marching.make_ray`.

    Returns
    -------
    ndarray of float64, shape (14,)
        In voxels, with voxel (0, 0, 0) at the origin: the eye (3), the forward
        direction (3), and the offsets to the right (3) and upper (3) edge of the
        image. Then the near plane's distance in world units, and the square of
        the tangent of half the view angle.
    """
    right, up, back = view.basis()
    spacing = np.array(volume.spacing)
    distance = view.camera_distance(volume.radius)
    # From the first voxel, not from the origin, which may be far away.
    eye = np.array(volume.extent) / 2 + distance * back
    tangent = math.tan(math.radians(VIEW_ANGLE / 2))
    return np.concatenate(
        [
            eye / spacing,
            -back / spacing,
            tangent * right / spacing,
            tangent * up / spacing,
            [view.near_distance(volume.radius), tangent**2],
        ]
    )
