"""The camera as an array of numbers, for the construction of rays."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from model.rendering.raster import Raster
from model.scene.crop import CropBox
from model.scene.view import VIEW_ANGLE, View
from model.scene.volume import Geometry


def camera_array(
    view: View,
    volume: Geometry,
    raster: Raster | None = None,
    crop: CropBox | None = None,
) -> NDArray[np.float64]:
    """Return the camera of a view, for :func:`model.rendering.raycast.rays.make_ray`.

    Parameters
    ----------
    raster : Raster, optional
        Pixels to draw; by default a square image of any size.
    crop : CropBox, optional
        Part of the volume that is shown; all of it by default.

    Returns
    -------
    ndarray of float64, shape (24,)
        In voxels, with voxel (0, 0, 0) at the origin: the eye (3), the forward
        direction (3), and the offsets to the right (3) and upper (3) edge of a
        square image. Then the near plane's distance in world units, and the square of
        the tangent of half the view angle. Then offset and scale of the pixels' places
        to the right (2) and upwards (2), and the least (3) and greatest (3) corner of
        what is shown.
    """
    right, up, back = view.basis()
    spacing = np.array(volume.spacing)
    distance = view.camera_distance(volume.radius)
    # From the first voxel, not from the origin, which may be far away.
    eye = np.array(volume.extent) / 2 + distance * back
    tangent = math.tan(math.radians(VIEW_ANGLE / 2))
    raster = raster or Raster(1, 1)
    # The kernels count both columns and rows in halves of the raster's width, from its upper edge.
    (x, y), (half_width, half_height) = raster.center, raster.half_size
    crop = crop or CropBox()
    last = np.array(volume.dimensions) - 1
    return np.concatenate(
        [
            eye / spacing,
            -back / spacing,
            tangent * right / spacing,
            tangent * up / spacing,
            [view.near_distance(volume.radius), tangent**2],
            [x - view.pan_x, half_width, y + half_height - half_width - view.pan_y, half_width],
            np.array(crop.low) * last,
            np.array(crop.high) * last,
        ]
    )
