"""A generator that knows it is looking at a volume.

A learned feature grid is sampled on planes across the view's frustum. A small
network, modulated by the code of the opacity TF, goes over each point; then
the planes are folded into channels and decoded in 2-D. Colour follows from the
same samples, modulated by the codes of both TFs.

The latent code enters behind the sampling: derivatives by it pass through
small networks only, and have its rank.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import torch
from torch import Tensor, nn

from model.networks.blocks import (
    Modulation,
    NetworkSize,
    ResidualBlock,
    concatenate,
    initialise,
    keep_variance,
    mlp,
)
from model.networks.feature_grid import FeatureGrid
from model.networks.frustum import Frustum
from model.networks.opacity import OpacityNetwork
from model.networks.translation import color_encoder
from model.networks.two_stage import GeneratorNetwork
from model.scene import Scene

NODES = 32**3
PLANES = 16
FOLDED = 8
"""Features of each plane that become channels of the 2-D decoder."""


class Look(NamedTuple):
    """What the opacity generator saw on its way to an opacity image.

    Attributes
    ----------
    image : Tensor, shape (N, 1, So, So)
    samples : Tensor, shape (N, planes * size * size, features)
        Of the feature grid.
    code : Tensor, shape (N, channels)
        Features of the latent code.
    coarse, fine : Tensor, shapes (N, channels, size, size) and (N, channels / 2, So, So)
        The decoder's.
    """

    image: Tensor
    samples: Tensor
    code: Tensor
    coarse: Tensor
    fine: Tensor


class PointNetwork(nn.Module):
    """Two layers on each point; a code modulates the first through its weights."""

    def __init__(self, features: int, hidden: int, outputs: int, code: int) -> None:
        super().__init__()
        self.first = nn.Linear(features, hidden)
        self.second = nn.Linear(hidden, outputs)
        self.modulation = Modulation(code, hidden)

    def forward(self, samples: Tensor, code: Tensor) -> Tensor:
        """Map samples (N, points, features) and codes (N, code) to (N, points, outputs)."""
        scale, shift = self.modulation.factors(code)
        # As one product for each image: points are too many to scale each of their features.
        weight = self.first.weight.t() * (1 + scale)[:, None]
        bias = self.first.bias * (1 + scale) + shift
        dtype = samples.dtype
        hidden = torch.baddbmm(bias[:, None].to(dtype), samples, weight.to(dtype))
        outputs: Tensor = self.second(torch.relu_(hidden))
        return outputs


class GridOpacityGenerator(OpacityNetwork):
    """Draws the opacity image from the feature grid, the view and the latent code.

    Parameters
    ----------
    size : NetworkSize
    scene : Scene
        Its views and the volume's proportions.
    """

    def __init__(self, size: NetworkSize, scene: Scene) -> None:
        super().__init__(size)
        c = size.channels
        self.frustum = Frustum(scene.view_range, scene.proportions, PLANES, size.opacity_size // 2)
        self.latent = mlp(size.latent_dim, c(512), c(512))
        self.points = PointNetwork(size.features, c(128), FOLDED, c(512))
        self.coarse = Modulated(_entry(FOLDED * PLANES, c(256)), c(256), c(512))
        self.block = Modulated(ResidualBlock(c(256), c(256)), c(256), c(512))
        self.narrow = nn.Conv2d(c(256), c(128), 1)
        self.larger = _larger()
        self.fine = ResidualBlock(c(128), c(128))
        self.image = nn.Sequential(nn.Conv2d(c(128), 1, 3, padding=1), nn.Tanh())
        start(self)
        self.grid = FeatureGrid(scene.proportions, NODES, size.features)

    def see(self, view: Tensor) -> Tensor:
        """Samples (N, planes * size * size, features) of the grid for views (N, 5)."""
        with torch.autocast(view.device.type, enabled=False):
            # Places need float32's digits.
            samples = self.grid(self.frustum.points(view.to(self.grid.features.dtype)))
        samples = samples.flatten(1, 3)
        if torch.is_autocast_enabled(view.device.type):
            samples = samples.to(torch.get_autocast_dtype(view.device.type))
        return samples

    def draw_seen(self, seen: Tensor, latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) from samples of the grid and latent codes."""
        return self.look(seen, latent).image

    def look(self, samples: Tensor, latent: Tensor) -> Look:
        """The opacity image, with what else was found on the way."""
        code = self.latent(latent)
        coarse = self.coarse(fold(self.points(samples, code), self.frustum), code)
        coarse = self.block(coarse, code)
        fine = self.fine(self.larger(self.narrow(coarse)))
        return Look(self.image(fine), samples, code, coarse, fine)


class GridColorGenerator(nn.Module):
    """Paints what the opacity generator saw through its frustum."""

    def __init__(self, size: NetworkSize, frustum: Frustum) -> None:
        super().__init__()
        c = size.channels
        self.color_tf = color_encoder(size)
        self.merge = mlp(c(256) + c(512), c(512))
        self.frustum = frustum
        self.points = PointNetwork(size.features, c(128), FOLDED, c(512))
        self.coarse = Modulated(_entry(c(256) + FOLDED * PLANES, c(256)), c(256), c(512))
        self.block = Modulated(ResidualBlock(c(256), c(256)), c(256), c(512))
        self.narrow = nn.Conv2d(c(256), c(128), 1)
        self.larger = _larger()
        self.fine = Modulated(ResidualBlock(c(128), c(128)), c(128), c(512))
        doublings = int(math.log2(size.image_size // size.opacity_size))
        channels = [c(128 // 2**i) for i in range(doublings + 1)]
        self.finer = nn.ModuleList(
            nn.Sequential(nn.Conv2d(a, b, 1), _larger(), ResidualBlock(b, b))
            for a, b in pairwise(channels)
        )
        self.image = nn.Sequential(nn.Conv2d(channels[-1], 3, 3, padding=1), nn.Tanh())
        start(self)

    def forward(self, look: Look, color: Tensor) -> Tensor:
        """Colour images (N, 3, S, S) of a look, from codes of colour TFs."""
        code = self.merge(concatenate(color, look.code))
        folded = fold(self.points(look.samples, code), self.frustum)
        x = self.block(self.coarse(concatenate(look.coarse, folded), code), code)
        x = self.fine(self.larger(self.narrow(x)) + look.fine, code)
        for finer in self.finer:
            x = finer(x)
        image: Tensor = self.image(x)
        return image


class GridGenerator(GeneratorNetwork):
    """Opacity and colour image from one feature grid.

    Parameters
    ----------
    size : NetworkSize
    scene : Scene
    """

    opacity: GridOpacityGenerator

    def __init__(self, size: NetworkSize, scene: Scene) -> None:
        super().__init__()
        self.opacity = GridOpacityGenerator(size, scene)
        self.color = GridColorGenerator(size, self.opacity.frustum)

    def see(self, view: Tensor) -> tuple[Tensor, ...]:
        """Samples of the grid for views (N, 5)."""
        return (self.opacity.see(view),)

    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Codes (N, channels) of colour TFs (N, 3, 256)."""
        code: Tensor = self.color.color_tf(color_tf)
        return code

    def draw(
        self, seen: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Colour and opacity image from samples of the grid and codes of both TFs."""
        look = self.opacity.look(seen[0], latent)
        return self.color(look, color), look.image


class Modulated(nn.Module):
    """Layers whose output a code scales and shifts."""

    def __init__(self, layers: nn.Module, channels: int, code: int) -> None:
        super().__init__()
        self.layers = layers
        self.modulation = Modulation(code, channels)

    def forward(self, x: Tensor, code: Tensor) -> Tensor:
        """Map (N, channels_in, H, W) and codes (N, code) to (N, channels, H, W)."""
        y: Tensor = self.modulation(self.layers(x), code)
        return y


def fold(seen: Tensor, frustum: Frustum) -> Tensor:
    """Features of points (N, points, C) as images (N, planes * C, size, size)."""
    edge = frustum.size
    planes = seen.reshape(len(seen), frustum.planes, edge, edge, -1)
    return planes.permute(0, 2, 3, 1, 4).flatten(3).permute(0, 3, 1, 2)


def start(network: nn.Module) -> None:
    """First weights: by the fan-in wherever no batch norm follows."""
    initialise(network)
    keep_variance(network)
    for layer in network.modules():
        if isinstance(layer, nn.Conv2d) and layer.bias is not None:
            nn.init.kaiming_normal_(layer.weight, nonlinearity="linear")


def _entry(channels_in: int, channels: int) -> nn.Sequential:
    # The planes lie along the line of sight: what belongs together is at the same pixel.
    return nn.Sequential(
        nn.Conv2d(channels_in, channels, 1, bias=False),
        nn.BatchNorm2d(channels),
        nn.ReLU(),
    )


def _larger() -> nn.Upsample:
    """Twice as many pixels along both axes, smoothly."""
    return nn.Upsample(scale_factor=2, mode="bilinear", align_corners=False)
