"""Sample points of a view: planes across the part of its frustum where the volume is.

Positions are in units of the volume's bounding-sphere radius, its centre at
the origin, along the same axes as :class:`model.scene.view.View`'s basis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from model.scene.view import FAR_DISTANCE_RADII, VIEW_ANGLE, ViewRange

SLOPE = math.tan(math.radians(VIEW_ANGLE / 2))
"""Half the image's height at distance 1 from the camera."""


@dataclass(frozen=True)
class Frustum:
    """How a view is cut into planes, square to the line of sight.

    Attributes
    ----------
    view_range : ViewRange
        What the encoded views refer to.
    extent : tuple of 3 float
        Half lengths of the volume along x, y and z.
    planes : int
        Number of planes, from the volume's front to its back.
    size : int
        Points along the edge of a plane, one in the middle of each pixel of
        an image of that size.
    """

    view_range: ViewRange
    extent: tuple[float, float, float]
    planes: int = 16
    size: int = 32

    def points(self, view: Tensor) -> Tensor:
        """Sample points of encoded views.

        Parameters
        ----------
        view : Tensor, shape (N, 5)
            See :meth:`model.scene.view.View.vector`.

        Returns
        -------
        Tensor, shape (N, planes, size, size, 3)
            x, y, z; planes from front to back, rows from the top.
        """
        right, up, back, distance = camera(view, self.view_range)
        half_depth = (back.abs() * back.new_tensor(self.extent)).sum(dim=1)
        places = 1 - (2 * torch.arange(self.planes).to(view) + 1) / self.planes
        towards = half_depth[:, None] * places
        # Half the width of the image at each plane; nothing lies behind the camera.
        width = SLOPE * (distance[:, None] - towards).clamp(min=0)
        across = (2 * torch.arange(self.size).to(view) + 1) / self.size - 1
        x = width[:, :, None, None, None] * across[:, None]
        y = -width[:, :, None, None, None] * across[:, None, None]

        def along(axis: Tensor) -> Tensor:
            return axis[:, None, None, None, :]

        return x * along(right) + y * along(up) + towards[:, :, None, None, None] * along(back)


def camera(view: Tensor, view_range: ViewRange) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Decode views (N, 5): right, up and back, each (N, 3), and distances (N,) in radii."""
    elevation = view[:, 0] * math.radians(view_range.max_elevation)
    cos_a, sin_a = view[:, 1], view[:, 2]
    roll = view[:, 3] * math.radians(view_range.max_roll)
    middle = (view_range.farthest + view_range.nearest) / 2
    half = (view_range.farthest - view_range.nearest) / 2
    distance = (middle + view[:, 4] * half) * FAR_DISTANCE_RADII
    sin_e, cos_e = elevation.sin(), elevation.cos()
    sin_r, cos_r = roll.sin()[:, None], roll.cos()[:, None]
    right = torch.stack([cos_a, sin_a, torch.zeros_like(cos_a)], dim=1)
    up = torch.stack([-sin_e * sin_a, sin_e * cos_a, cos_e], dim=1)
    back = torch.stack([cos_e * sin_a, -cos_e * cos_a, sin_e], dim=1)
    return cos_r * right + sin_r * up, cos_r * up - sin_r * right, back, distance
