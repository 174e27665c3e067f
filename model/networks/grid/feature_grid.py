"""A learned 3-D grid of features over the volume, and its interpolation.

The interpolation weights follow from the view alone: nothing but the features
needs a gradient, and derivatives by the transfer function never pass here.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import grid_sample

from model.networks.grid.grid_kernels import gather, scatter
from model.networks.grid.kernel_threads import in_pieces, suits_kernels, summed_in_pieces

FIRST_SPREAD = 0.3
"""Standard deviation of the first features."""


class FeatureGrid(nn.Module):
    """Features on a grid of cubic cells over a box around the origin.

    Parameters
    ----------
    extent : tuple of 3 float
        Half lengths of the box along x, y and z.
    nodes : int
        Number of nodes, about.
    channels : int
        Features at each node.

    Attributes
    ----------
    features : Parameter, shape (nz * ny * nx, channels)
        x fastest.
    shape : tuple of 3 int
        Nodes along x, y and z; the outermost lie on the box's faces.
    """

    def __init__(self, extent: tuple[float, float, float], nodes: int, channels: int) -> None:
        super().__init__()
        spacing = (8 * math.prod(extent) / nodes) ** (1 / 3)
        nx, ny, nz = (max(2, round(2 * length / spacing)) for length in extent)
        self.shape = (nx, ny, nz)
        self.extent = extent
        self.features = nn.Parameter(FIRST_SPREAD * torch.randn(nx * ny * nz, channels))

    def forward(self, points: Tensor) -> Tensor:
        """Interpolate trilinearly; the grid is surrounded by zeros.

        Parameters
        ----------
        points : Tensor, shape (..., 3)
            x, y, z in the unit of `extent`; no gradient flows to them.

        Returns
        -------
        Tensor, shape (..., channels)
        """
        box = points.new_tensor(self.extent)
        inside = (points.detach() / box).reshape(-1, 3)
        if suits_kernels(self.features):
            found: Tensor = _Interpolation.apply(self.features, inside, self.shape)  # type: ignore[no-untyped-call]
        else:
            found = interpolate_grid(self.features, inside, self.shape)
        return found.reshape(*points.shape[:-1], -1)


def interpolate_grid(features: Tensor, points: Tensor, shape: tuple[int, int, int]) -> Tensor:
    """Interpolate by torch itself: for GPUs, and to test against.

    Parameters
    ----------
    features : Tensor, shape (nz * ny * nx, channels)
    points : Tensor, shape (P, 3)
        The grid reaches from -1 to 1.
    shape : tuple of 3 int

    Returns
    -------
    Tensor, shape (P, channels)
    """
    nx, ny, nz = shape
    grid = features.t().reshape(1, -1, nz, ny, nx)
    places = points[None, None, None].to(features.dtype)
    return grid_sample(grid, places, align_corners=True)[0, :, 0, 0].t()


class _Interpolation(torch.autograd.Function):
    """The same on CPU threads, some 30 times as fast as torch's operators there."""

    @staticmethod
    def forward(ctx: Any, features: Tensor, points: Tensor, shape: tuple[int, int, int]) -> Tensor:
        points = points.to(torch.float32).contiguous()
        found = features.new_empty(len(points), features.shape[1])
        places, values, out = points.numpy(), features.detach().numpy(), found.numpy()

        def part(piece: slice) -> None:
            gather(places[piece], shape, values, out[piece])

        in_pieces(len(points), part)
        ctx.save_for_backward(points)
        ctx.shape, ctx.nodes = shape, features.shape
        return found

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None]:
        (points,) = ctx.saved_tensors
        places, values = points.numpy(), gradients[0].contiguous().numpy()

        def add(piece: slice, total: NDArray[np.float32]) -> None:
            scatter(places[piece], ctx.shape, values[piece], total)

        return summed_in_pieces(len(points), ctx.nodes, add), None, None
