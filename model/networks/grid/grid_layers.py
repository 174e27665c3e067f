"""Layers that the feature grid's opacity and colour generator share."""

from __future__ import annotations

import math

from torch import Tensor, nn

from model.networks.blocks import concatenate, initialize, kaiming_init
from model.networks.grid.frustum import Frustum
from model.networks.grid.points import RayNetwork
from model.networks.grid.ray_kernels import FEATURES

RAY_UNITS = 8
"""Depths that lines of sight look up in the opacity TF."""


class Details(nn.Module):
    """Adds what lines of sight show under an opacity TF to an image's features."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.shown = RayNetwork(FEATURES, RAY_UNITS)
        self.entry = entry(channels + 2 * RAY_UNITS, channels)

    def forward(self, x: Tensor, sums: Tensor, opacities: Tensor) -> Tensor:
        """Map features (N, channels, S, S), sums of at most as many lines, and TFs to features."""
        edge = math.isqrt(sums.shape[1])
        lines = sums.transpose(1, 2).reshape(len(sums), -1, edge, edge)
        if edge < x.shape[2]:
            # Sums vary less from pixel to pixel than what they show.
            lines = nn.functional.interpolate(lines, x.shape[2:], mode="bilinear")
        shown = self.shown(lines.flatten(2).transpose(1, 2), opacities)
        shown = shown.transpose(1, 2).reshape(len(x), -1, *x.shape[2:])
        y: Tensor = self.entry(concatenate(x, shown.to(x.dtype)))
        return y


def fold(seen: Tensor, frustum: Frustum) -> Tensor:
    """Features of points (N, points, C) as images (N, planes * C, size, size)."""
    edge = frustum.size
    planes = seen.reshape(len(seen), frustum.planes, edge, edge, -1)
    return planes.permute(0, 2, 3, 1, 4).flatten(3).permute(0, 3, 1, 2)


def start(network: nn.Module) -> None:
    """First weights: by the fan-in wherever no batch norm follows."""
    initialize(network)
    kaiming_init(network)
    for layer in network.modules():
        if isinstance(layer, nn.Conv2d) and layer.bias is not None:
            nn.init.kaiming_normal_(layer.weight, nonlinearity="linear")


def entry(channels_in: int, channels: int) -> nn.Sequential:
    """Mixes features of each pixel: what belongs together lies on its line of sight."""
    return nn.Sequential(
        nn.Conv2d(channels_in, channels, 1, bias=False),
        nn.BatchNorm2d(channels),
        nn.ReLU(),
    )


def larger() -> nn.Upsample:
    """Twice as many pixels along both axes, smoothly."""
    return nn.Upsample(scale_factor=2, mode="bilinear", align_corners=False)
