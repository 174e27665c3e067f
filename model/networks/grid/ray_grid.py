"""A fine feature grid that is seen as by X-rays: summed up along each pixel's line of sight.

An unlit opacity image follows from how far each line of sight runs through
each scalar value, whatever the order. Such sums have the detail of pixels, and
follow from the view alone: the latent code enters behind them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from model.networks.grid.feature_grid import FeatureGrid, interpolate_grid
from model.networks.grid.kernel_threads import in_pieces, suits_kernels, summed_in_pieces
from model.networks.grid.ray_kernels import FEATURES, project, spread
from model.networks.grid.rays import Rays, lines_of_sight
from model.scene.scene import Scene

TOGETHER = 16
"""Points of each line that torch interpolates at once: few enough for a GPU's memory."""


class RayGrid(nn.Module):
    """Features on a grid over the volume, summed up along lines of sight.

    Parameters
    ----------
    scene : Scene
        Its views and the volume's proportions.
    nodes : int
        Number of nodes, about.
    size : int
        Width and height of the image that the lines belong to.
    """

    def __init__(self, scene: Scene, nodes: int, size: int) -> None:
        super().__init__()
        self.grid = FeatureGrid(scene.proportions, nodes, FEATURES)
        self._view_range = scene.view_range
        self._size = size

    def forward(self, view: Tensor) -> Tensor:
        """Sums (N, size * size, FEATURES) for views (N, 5), rows from the top."""
        features, shape = self.grid.features, self.grid.shape
        with torch.no_grad():
            view = view.to(features.dtype)
            rays = lines_of_sight(view, self._view_range, self.grid.extent, shape, self._size)
        if suits_kernels(features):
            sums: Tensor = _Projection.apply(features, rays, shape)  # type: ignore[no-untyped-call]
        else:
            sums = project_rays(features, rays, shape)
        return sums.reshape(len(view), -1, FEATURES)


def project_rays(features: Tensor, rays: Rays, shape: tuple[int, int, int]) -> Tensor:
    """Sum up by torch itself: for GPUs, and to test against.

    Parameters
    ----------
    features : Tensor, shape (nz * ny * nx, channels)
    rays : Rays
    shape : tuple of 3 int

    Returns
    -------
    Tensor, shape (R, channels)
    """
    last = rays.first.new_tensor(shape) - 1
    sums = features.new_zeros(len(rays.points), features.shape[1])
    for start in range(0, int(rays.points.max()), TOGETHER):
        point = start + torch.arange(TOGETHER, device=last.device)[:, None]
        places = 2 * (rays.first + point[..., None] * rays.step) / last - 1
        found = interpolate_grid(features, places.flatten(0, 1), shape)
        weight = torch.where(point < rays.points, rays.weight, 0.0)
        sums = sums + (weight[..., None] * found.reshape(*weight.shape, -1)).sum(dim=0)
    return sums


class _Projection(torch.autograd.Function):
    """The same on CPU threads."""

    @staticmethod
    def forward(ctx: Any, features: Tensor, rays: Rays, shape: tuple[int, int, int]) -> Tensor:
        sums = features.new_empty(len(rays.points), FEATURES)
        lines = [x.contiguous().numpy() for x in rays]
        values, out = features.detach().numpy(), sums.numpy()

        def part(piece: slice) -> None:
            first, step, points, weight = (x[piece] for x in lines)
            project(first, step, points, weight, shape, values, out[piece])

        in_pieces(len(out), part)
        ctx.lines, ctx.shape, ctx.nodes = lines, shape, features.shape
        return sums

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None]:
        values = gradients[0].contiguous().numpy()

        def add(piece: slice, total: NDArray[np.float32]) -> None:
            first, step, points, weight = (x[piece] for x in ctx.lines)
            spread(first, step, points, weight, ctx.shape, values[piece], total)

        return summed_in_pieces(len(values), ctx.nodes, add), None, None
