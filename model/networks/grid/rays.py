"""Lines of sight through a grid of nodes: where each pixel's begins, and its points."""

from __future__ import annotations

import math
from typing import NamedTuple

import torch
from torch import Tensor

from model.networks.grid.frustum import SLOPE, camera
from model.scene.view import ViewRange
from model.scene.volume import Triple

STEP = 1.5
"""Largest distance between points of a line of sight, in nodes."""

UNIT = 16.0
"""Nodes that a line's points are weighted by, so that sums are as large as what is summed."""

ALMOST_ZERO = 1e-9


class Rays(NamedTuple):
    """Points at equal distances on lines of sight, each in the middle of its part of the line.

    Attributes
    ----------
    first, step : Tensor, shape (R, 3)
        x, y, z of a line's first point, and from each point to the next, in nodes.
    points : Tensor of int32, shape (R,)
        Number of points on each line; 0 where it misses the grid.
    weight : Tensor, shape (R,)
        Distance between a line's points, in units of :data:`UNIT` nodes.
    """

    first: Tensor
    step: Tensor
    points: Tensor
    weight: Tensor


def lines_of_sight(
    view: Tensor, view_range: ViewRange, extent: Triple, shape: tuple[int, int, int], size: int
) -> Rays:
    """Lines through the middles of an image's pixels, as far as they lie in a grid.

    Parameters
    ----------
    view : Tensor, shape (N, 5)
        See :meth:`model.scene.view.View.vector`.
    view_range : ViewRange
    extent : tuple of 3 float
        Half lengths of the grid along x, y and z.
    shape : tuple of 3 int
        Nodes along x, y and z; the outermost lie on the grid's faces.
    size : int
        Width and height of the image.

    Returns
    -------
    Rays
        N * size * size of them, rows from the top; nothing behind the camera.
    """
    right, up, back, distance = (x.reshape(len(view), 1, 1, -1) for x in camera(view, view_range))
    across = (2 * torch.arange(size).to(view) + 1) / size - 1
    aside = across[:, None] * right - across[:, None, None] * up
    # Both for a step of 1 towards the camera: from the plane through the origin.
    start = SLOPE * distance * aside
    along = back - SLOPE * aside
    along = torch.where(along.abs() < ALMOST_ZERO, ALMOST_ZERO, along)
    box = view.new_tensor(extent)
    faces = torch.stack([(-box - start) / along, (box - start) / along])
    farthest = faces.amin(dim=0).amax(dim=-1)
    nearest = torch.minimum(faces.amax(dim=0).amin(dim=-1), distance[..., 0])
    nodes = view.new_tensor(shape) - 1
    spacing = math.prod(2 * length / (n - 1) for length, n in zip(extent, shape, strict=True))
    length = (nearest - farthest).clamp(min=0) * along.norm(dim=-1) / spacing ** (1 / 3)
    count = (length / STEP).ceil()
    between = (nearest - farthest) / count.clamp(min=1)
    hit = (count > 0)[..., None]
    first = (start + (farthest + between / 2)[..., None] * along + box) * nodes / (2 * box)
    step = between[..., None] * along * nodes / (2 * box)
    return Rays(
        torch.where(hit, first, 0.0).flatten(0, 2),
        torch.where(hit, step, 0.0).flatten(0, 2),
        count.flatten().to(torch.int32),
        (length / count.clamp(min=1) / UNIT).flatten(),
    )
