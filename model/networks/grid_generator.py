"""A generator that knows it is looking at a volume.

A learned feature grid is sampled on planes across the view's frustum. A small
network, modulated by the code of the opacity TF, goes over each point; then
the planes are folded into channels and decoded in 2-D. Details come from a
finer grid, summed up along each pixel's line of sight. From all this follows
how much of each scalar value every pixel shows; the colour TF says the rest.

The latent code enters behind the sampling: derivatives by it pass through
small networks only, and have its rank.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import torch
from torch import Tensor, nn

from model.encoding import decode_colors, decode_unit
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
from model.networks.points import PointNetwork, RayNetwork, binned
from model.networks.ray_grid import RayGrid
from model.networks.ray_kernels import FEATURES
from model.networks.two_stage import GeneratorNetwork
from model.scene import Scene

NODES = 32**3
PLANES = 16
LOOKED_UP = 8
"""Units of each point that look the opacity TF up."""

COLORS = 32
"""Scalar values that the colour of a pixel is mixed from."""

FAINT = 0.01
"""Opacity that is added before a scalar value's share of a pixel is guessed from the TF."""

RAY_NODES = 48**3
RAY_UNITS = 8

FOLDED = 8
"""Features of each plane that become channels of the 2-D decoder."""


class Look(NamedTuple):
    """What the opacity generator saw on its way to an opacity image.

    Attributes
    ----------
    image : Tensor, shape (N, 1, So, So)
    samples : Tensor, shape (N, planes * size * size, features)
        Of the feature grid.
    sums : Tensor, shape (N, lines, FEATURES), or None
        Along lines of sight.
    code : Tensor, shape (N, channels)
        Features of the latent code.
    opacities : Tensor, shape (N, 1, BINS)
        The opacity TF that the latent code stands for, 0..1.
    coarse, fine : Tensor, shapes (N, channels, size, size) and (N, channels / 2, So, So)
        The decoder's.
    """

    image: Tensor
    samples: Tensor
    sums: Tensor | None
    code: Tensor
    opacities: Tensor
    coarse: Tensor
    fine: Tensor


class GridOpacityGenerator(OpacityNetwork):
    """Draws the opacity image from the feature grid, the view and the latent code.

    Parameters
    ----------
    size : NetworkSize
    scene : Scene
        Its views and the volume's proportions.
    lines : int, optional
        Width and height of the image that has a line of sight for each pixel:
        the opacity image, or one 2, 4 or more powers of two as large.
    """

    def __init__(self, size: NetworkSize, scene: Scene, lines: int | None = None) -> None:
        # Points look up the TF that the code stands for: it had better be the right one, and
        # a codec of full width is cheap beside the images.
        super().__init__(replace(size, width=max(1.0, size.width)))
        c = size.channels
        self.frustum = Frustum(scene.view_range, scene.proportions, PLANES, size.opacity_size // 2)
        self.latent = mlp(size.latent_dim, c(512), c(512))
        self.points = PointNetwork(size.features, c(128), LOOKED_UP, FOLDED, c(512))
        self.coarse = Modulated(_entry(FOLDED * PLANES, c(256)), c(256), c(512))
        self.block = Modulated(ResidualBlock(c(256), c(256)), c(256), c(512))
        self.narrow = nn.Conv2d(c(256), c(128), 1)
        self.larger = _larger()
        self.details = Details(c(128)) if size.rays else None
        self.fine = ResidualBlock(c(128), c(128))
        self.image = nn.Sequential(nn.Conv2d(c(128), 1, 3, padding=1), nn.Tanh())
        start(self)
        self.grid = FeatureGrid(scene.proportions, NODES, size.features)
        lines = lines or size.opacity_size
        self.rays = RayGrid(scene, RAY_NODES, lines) if size.rays else None

    def see(self, view: Tensor) -> tuple[Tensor, ...]:
        """Samples (N, planes * size * size, features) of the grid for views (N, 5).

        With rays, also the sums (N, lines, FEATURES) along lines of sight.
        """
        with torch.autocast(view.device.type, enabled=False):
            # Places need float32's digits.
            samples = self.grid(self.frustum.points(view.to(self.grid.features.dtype)))
            sums = () if self.rays is None else (self.rays(view),)
        samples = samples.flatten(1, 3)
        if torch.is_autocast_enabled(view.device.type):
            samples = samples.to(torch.get_autocast_dtype(view.device.type))
        return samples, *sums

    def draw_seen(self, seen: tuple[Tensor, ...], latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) from what :meth:`see` gave and latent codes."""
        return self.look(seen, latent).image

    def look(self, seen: tuple[Tensor, ...], latent: Tensor) -> Look:
        """The opacity image, with what else was found on the way."""
        samples, sums = seen[0], seen[1] if len(seen) > 1 else None
        code = self.latent(latent)
        opacities = binned(decode_unit(self.decode(latent)[:, None]))
        folded = fold(self.points(samples, code, opacities), self.frustum)
        coarse = self.block(self.coarse(folded, code), code)
        fine = self.larger(self.narrow(coarse))
        if self.details is not None and sums is not None:
            fine = self.details(fine, sums, opacities)
        fine = self.fine(fine)
        return Look(self.image(fine), samples, sums, code, opacities, coarse, fine)


class GridColorGenerator(nn.Module):
    """Paints what the opacity generator saw through its frustum.

    A pixel of an unlit rendering is a sum over scalar values: how much of each
    is seen there, times its colour. The network says how much, by view and
    latent code; the colour TF enters exactly, and nothing of it is learned.
    Where the scene is lit, white highlights are one more share.

    Parameters
    ----------
    size : NetworkSize
    frustum : Frustum
    lit : bool
    """

    def __init__(self, size: NetworkSize, frustum: Frustum, lit: bool) -> None:
        super().__init__()
        c = size.channels
        self.frustum = frustum
        self.lit = lit
        self.points = PointNetwork(size.features, c(128), LOOKED_UP, FOLDED, c(512))
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
        self.details = Details(channels[-1]) if size.rays and doublings else None
        self.visible = nn.Conv2d(channels[-1], 1, 3, padding=1)
        self.shares = nn.Conv2d(channels[-1], COLORS + lit, 1)
        self.trust = nn.Parameter(torch.ones(1))
        start(self)

    def forward(self, look: Look, colors: Tensor) -> Tensor:
        """Colour images (N, 3, S, S) of a look.

        Parameters
        ----------
        look : Look
        colors : Tensor, shape (N, 3, COLORS)
            In RGB, 0..1.
        """
        folded = fold(self.points(look.samples, look.code, look.opacities), self.frustum)
        x = self.block(self.coarse(concatenate(look.coarse, folded), look.code), look.code)
        x = self.fine(self.larger(self.narrow(x)) + look.fine, look.code)
        for i, finer in enumerate(self.finer, 1):
            narrow, larger, block = finer.children()
            x = larger(narrow(x))
            if self.details is not None and look.sums is not None and i == len(self.finer):
                x = self.details(x, look.sums, look.opacities)
            x = block(x)
        # What the TF does not show is not seen, unless the network insists.
        opacities = binned(look.opacities, COLORS)
        if self.lit:
            opacities = nn.functional.pad(opacities, (0, 1))
            colors = nn.functional.pad(colors, (0, 1), value=1.0)
        shown = self.trust * torch.log(opacities + FAINT)
        # The shares of a pixel side by side, as convolutions in channels-last order leave them.
        logits = self.shares(x).permute(0, 2, 3, 1).flatten(1, 2)
        shares = torch.softmax(logits.to(shown.dtype) + shown, dim=2)
        color = torch.bmm(shares, colors.transpose(1, 2)).transpose(1, 2)
        visible = torch.sigmoid(self.visible(x).to(color.dtype))
        return 2 * visible * color.reshape(len(x), 3, *x.shape[2:]) - 1


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
        self.opacity = GridOpacityGenerator(size, scene, size.image_size)
        self.color = GridColorGenerator(size, self.opacity.frustum, scene.lighting != "none")

    def see(self, view: Tensor) -> tuple[Tensor, ...]:
        """What the opacity generator sees for views (N, 5)."""
        return self.opacity.see(view)

    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Colours (N, 3, COLORS) in RGB of colour TFs (N, 3, 256)."""
        return binned(decode_colors(color_tf), COLORS)

    def draw(
        self, seen: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Colour and opacity image from what was seen and codes of both TFs."""
        look = self.opacity.look(seen, latent)
        return self.color(look, color), look.image


class Details(nn.Module):
    """Adds what lines of sight show under an opacity TF to an image's features."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.shown = RayNetwork(FEATURES, RAY_UNITS)
        self.entry = _entry(channels + 2 * RAY_UNITS, channels)

    def forward(self, x: Tensor, sums: Tensor, opacities: Tensor) -> Tensor:
        """Map features (N, channels, S, S), sums of as many or more lines, and TFs to features."""
        edge = math.isqrt(sums.shape[1])
        lines = sums.transpose(1, 2).reshape(len(sums), -1, edge, edge)
        if edge > x.shape[2]:
            lines = nn.functional.avg_pool2d(lines, edge // x.shape[2])
        shown = self.shown(lines.flatten(2).transpose(1, 2), opacities)
        shown = shown.transpose(1, 2).reshape(len(x), -1, *x.shape[2:])
        y: Tensor = self.entry(concatenate(x, shown.to(x.dtype)))
        return y


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
