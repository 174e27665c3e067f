"""The camera as the numbers that rays are made of."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from model.scene.view import VIEW_ANGLE, View
from model.scene.volume import Volume


def camera_array(view: View, volume: Volume) -> NDArray[np.float64]:
    """A view of a volume, for :func:`model.rendering.raycast.marching.make_ray`.

    Returns
    -------
    ndarray of float64, shape (14,)
        In voxels, voxel (0, 0, 0) at the origin: the eye (3); the direction
        forward (3); those to the right (3) and upper (3) edge of the image; in
        world units the near plane's distance; the square of the tangent of
        half the view angle.
    """
    right, up, back = view.basis()
    spacing = np.array(volume.spacing)
    distance = view.camera_distance(volume.radius)
    eye = np.array(volume.center) + distance * back - np.array(volume.origin)
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
