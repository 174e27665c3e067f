"""The opacity generator that samples a learned feature grid.

The grid is sampled on planes across the view's frustum. A small network,
modulated by the code of the opacity TF, goes over each point; then the planes
are folded into channels and decoded in 2-D. Details come from a finer grid,
summed up along each pixel's line of sight, where the TF is looked up again.

The latent code enters behind the sampling: derivatives by it pass through
small networks only, and have its rank.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import torch
from torch import Tensor, nn

from model.networks.blocks import ResidualBlock, mlp
from model.networks.encoding import decode_unit
from model.networks.generator_network import OpacityNetwork
from model.networks.grid.feature_grid import FeatureGrid
from model.networks.grid.frustum import Frustum
from model.networks.grid.grid_layers import Details, entry, fold, larger, start
from model.networks.grid.points import PointNetwork, binned
from model.networks.grid.ray_grid import RayGrid
from model.networks.size import NetworkSize
from model.scene.scene import Scene

NODES = 32**3
RAY_NODES = 48**3
PLANES = 16
LOOKED_UP = 8
"""Units of each point that look the opacity TF up."""

FOLDED = 8
"""Features of each plane that become channels of the 2-D decoder."""


class OpacityFeatures(NamedTuple):
    """What the opacity generator saw on its way to an opacity image.

    Attributes
    ----------
    image : Tensor, shape (N, 1, So, So)
    samples : Tensor, shape (N, planes * size * size, features)
        Of the feature grid.
    sums : Tensor, shape (N, So * So, FEATURES), or None
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
    """

    def __init__(self, size: NetworkSize, scene: Scene) -> None:
        # Points look up the TF that the code stands for: it had better be the right one, and
        # a codec of full width is cheap beside the images.
        super().__init__(replace(size, width=max(1.0, size.width)))
        c = size.channels
        self.frustum = Frustum(scene.view_range, scene.proportions, PLANES, size.opacity_size // 2)
        self.latent = mlp(size.latent_dim, c(512), c(512))
        self.points = PointNetwork(size.features, c(128), LOOKED_UP, FOLDED, c(512))
        self.coarse = nn.Sequential(entry(FOLDED * PLANES, c(256)), ResidualBlock(c(256), c(256)))
        self.narrow = nn.Conv2d(c(256), c(128), 1)
        self.larger = larger()
        self.details = Details(c(128)) if size.rays else None
        self.fine = ResidualBlock(c(128), c(128))
        self.image = nn.Sequential(nn.Conv2d(c(128), 1, 3, padding=1), nn.Tanh())
        start(self)
        self.grid = FeatureGrid(scene.proportions, NODES, size.features)
        self.rays = RayGrid(scene, RAY_NODES, size.opacity_size) if size.rays else None

    def encode_view(self, view: Tensor) -> tuple[Tensor, ...]:
        """Samples (N, planes * size * size, features) of the grid for views (N, 5).

        With rays, also the sums (N, So * So, FEATURES) along lines of sight.
        """
        with torch.autocast(view.device.type, enabled=False):
            # Places need float32's digits.
            samples = self.grid(self.frustum.points(view.to(self.grid.features.dtype)))
            sums = () if self.rays is None else (self.rays(view),)
        samples = samples.flatten(1, 3)
        if torch.is_autocast_enabled(view.device.type):
            samples = samples.to(torch.get_autocast_dtype(view.device.type))
        return samples, *sums

    def decode_image(self, view_features: tuple[Tensor, ...], latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) from what :meth:`encode_view` gave and latent codes."""
        return self.look(view_features, latent).image

    def look(self, view_features: tuple[Tensor, ...], latent: Tensor) -> OpacityFeatures:
        """The opacity image, with what else was found on the way."""
        samples, sums = view_features[0], view_features[1] if len(view_features) > 1 else None
        code = self.latent(latent)
        opacities = binned(decode_unit(self.decode(latent)[:, None]))
        folded = fold(self.points(samples, code, opacities), self.frustum)
        coarse = self.coarse(folded)
        fine = self.larger(self.narrow(coarse))
        if self.details is not None and sums is not None:
            fine = self.details(fine, sums, opacities)
        fine = self.fine(fine)
        return OpacityFeatures(self.image(fine), samples, sums, code, opacities, coarse, fine)
