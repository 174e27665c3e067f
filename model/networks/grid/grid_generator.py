"""A generator that knows it is looking at a volume.

From what the opacity generator sees in its feature grids follows how much of
each scalar value every pixel shows; the colour TF says the rest.
"""

from __future__ import annotations

import math
from itertools import pairwise

import torch
from torch import Tensor, nn

from model.networks.blocks import ResidualBlock, concatenate, mlp
from model.networks.encoding import decode_colors
from model.networks.generator_network import GeneratorNetwork
from model.networks.grid.frustum import Frustum
from model.networks.grid.grid_layers import Details, entry, fold, larger, start
from model.networks.grid.grid_opacity import (
    FOLDED,
    LOOKED_UP,
    PLANES,
    GridOpacityGenerator,
    OpacityFeatures,
)
from model.networks.grid.points import PointNetwork, binned
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene
from model.scene.view import VIEW_PARAMETERS

COLORS = 32
"""Scalar values that the colour of a pixel is mixed from."""

FAINT = 0.01
"""Opacity that is added before a scalar value's share of a pixel is guessed from the TF."""


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
    others : int
        Conditions beside the view, such as the light's.
    """

    def __init__(self, size: NetworkSize, frustum: Frustum, lit: bool, others: int = 0) -> None:
        super().__init__()
        c = size.channels
        self.others = mlp(others, c(512), c(512)) if others else None
        self.frustum = frustum
        self.lit = lit
        self.points = PointNetwork(size.features, c(128), LOOKED_UP, FOLDED, c(512))
        self.coarse = nn.Sequential(
            entry(c(256) + FOLDED * PLANES, c(256)), ResidualBlock(c(256), c(256))
        )
        self.narrow = nn.Conv2d(c(256), c(128), 1)
        self.larger = larger()
        self.fine = ResidualBlock(c(128), c(128))
        doublings = int(math.log2(size.image_size // size.opacity_size))
        channels = [c(128 // 2**i) for i in range(doublings + 1)]
        self.finer = nn.ModuleList(
            nn.Sequential(nn.Conv2d(a, b, 1), larger(), ResidualBlock(b, b))
            for a, b in pairwise(channels)
        )
        self.details = Details(channels[-1]) if size.rays and doublings else None
        self.visible = nn.Conv2d(channels[-1], 1, 3, padding=1)
        self.shares = nn.Conv2d(channels[-1], COLORS + lit, 1)
        self.trust = nn.Parameter(torch.ones(1))
        start(self)

    def forward(
        self, look: OpacityFeatures, colors: Tensor, others: Tensor | None = None
    ) -> Tensor:
        """Colour images (N, 3, S, S) of a look.

        Parameters
        ----------
        look : OpacityFeatures
        colors : Tensor, shape (N, 3, COLORS)
            In RGB, 0..1.
        others : Tensor, shape (N, others), or None
        """
        code = look.code
        if self.others is not None and others is not None:
            code = code + self.others(others)
        folded = fold(self.points(look.samples, code, look.opacities), self.frustum)
        x = self.coarse(concatenate(look.coarse, folded))
        x = self.fine(self.larger(self.narrow(x)) + look.fine)
        for i, finer in enumerate(self.finer, 1):
            narrow, enlarge, block = finer.children()
            x = enlarge(narrow(x))
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
        self.opacity = GridOpacityGenerator(size, scene)
        self._others = condition_numbers(scene) - VIEW_PARAMETERS
        lit = scene.lighting != "none"
        self.color = GridColorGenerator(size, self.opacity.frustum, lit, self._others)

    def encode_view(self, conditions: Tensor) -> tuple[Tensor, ...]:
        """Compute the features of the views; other conditions, if any, follow as they are."""
        view, others = conditions[:, :VIEW_PARAMETERS], conditions[:, VIEW_PARAMETERS:]
        features = self.opacity.encode_view(view)
        return (*features, others) if self._others else features

    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Colours (N, 3, COLORS) in RGB of colour TFs (N, 3, 256)."""
        with torch.autocast(color_tf.device.type, enabled=False):
            # What enters exactly must not be rounded on its way.
            return binned(decode_colors(color_tf), COLORS)

    def decode(
        self, view_features: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Colour and opacity image from features of the view and codes of both TFs."""
        others = None
        if self._others:
            *of_view, others = view_features
            view_features = tuple(of_view)
        look = self.opacity.look(view_features, latent)
        return self.color(look, color, others), look.image
