"""The opacity GAN (paper, section 4.2.1): view and opacity TF to an opacity image."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from itertools import pairwise
from typing import NamedTuple

from torch import Tensor, nn

from model.networks.blocks import (
    LEAK,
    VIEW_PARAMETERS,
    ImageDiscriminator,
    NetworkSize,
    ResidualBlock,
    TFEncoder,
    concatenate,
    initialise,
    mlp,
    score_head,
    upsample,
)
from model.transfer_function import TF_SAMPLES


class OpacityOutput(NamedTuple):
    """What the opacity generator makes of a view and an opacity TF.

    Attributes
    ----------
    image : Tensor, shape (N, 1, S, S)
        Opacity image, in [-1, 1].
    decoded_tf : Tensor, shape (N, 256)
        The opacity TF reconstructed from the latent code, in [-1, 1].
    latent : Tensor, shape (N, latent_dim)
    """

    image: Tensor
    decoded_tf: Tensor
    latent: Tensor


class LatentCodec(nn.Module):
    """The latent code of an opacity TF, and the TF that it stands for."""

    def __init__(self, size: NetworkSize) -> None:
        super().__init__()
        c = size.channels
        hidden = [c(512), c(512)] if size.deep_codec else [c(128)]
        self.encoder = nn.Sequential(
            TFEncoder([1, c(16), c(32), c(64), c(128), c(128)], c(256)),
            nn.Linear(c(256), size.latent_dim),
            nn.LeakyReLU(LEAK),
        )
        self.tf_decoder = nn.Sequential(
            mlp(size.latent_dim, *hidden), nn.Linear(hidden[-1], TF_SAMPLES), nn.Tanh()
        )

    def encode(self, opacity_tf: Tensor) -> Tensor:
        """Latent codes (N, latent_dim) of opacity TFs (N, 256)."""
        z: Tensor = self.encoder(opacity_tf[:, None])
        return z

    def decode(self, latent: Tensor) -> Tensor:
        """Opacity TFs (N, 256) of latent codes (N, latent_dim)."""
        tf: Tensor = self.tf_decoder(latent)
        return tf


class OpacityNetwork(LatentCodec, ABC):
    """What every opacity generator can do."""

    def forward(self, view: Tensor, opacity_tf: Tensor) -> OpacityOutput:
        """Render from views (N, 5) and opacity TFs (N, 256), both in [-1, 1]."""
        latent = self.encode(opacity_tf)
        return OpacityOutput(self.draw(view, latent), self.decode(latent), latent)

    def draw(self, view: Tensor, latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) in [-1, 1] from views (N, 5) and latent codes."""
        return self.draw_seen(self.see(view), latent)

    @abstractmethod
    def see(self, view: Tensor) -> tuple[Tensor, ...]:
        """What views (N, 5) alone decide; for all latent codes the same."""

    @abstractmethod
    def draw_seen(self, seen: tuple[Tensor, ...], latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) from what :meth:`see` gave and latent codes."""


class OpacityGenerator(OpacityNetwork):
    """The paper's: draws the opacity image from latent code and view by 2-D convolutions."""

    def __init__(self, size: NetworkSize) -> None:
        super().__init__(size)
        c = size.channels
        self.view = mlp(VIEW_PARAMETERS, c(512), c(512))
        self.latent = mlp(size.latent_dim, c(512))
        self.merge = mlp(2 * c(512), c(512), c(512))
        doublings = int(math.log2(size.opacity_size))
        # 512 channels as long as the image is small, then half as many after each doubling.
        full = [min(512, 32 * 2 ** (doublings - i)) for i in range(doublings)]
        blocks: list[nn.Module] = []
        for i, (a, b) in enumerate(pairwise([*map(c, full), 1])):
            # All pixels of the first block are copies of one: a kernel of 1 sees all there is.
            blocks += [upsample(), ResidualBlock(a, b, 1 if i == 0 else 3, last=b == 1)]
        self.image = nn.Sequential(*blocks, nn.Tanh())
        initialise(self)

    def see(self, view: Tensor) -> tuple[Tensor, ...]:
        """Codes (N, channels) of views (N, 5)."""
        return (self.view(view),)

    def draw_seen(self, seen: tuple[Tensor, ...], latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) from codes of views and latent codes."""
        fused = self.merge(concatenate(*seen, self.latent(latent)))
        image: Tensor = self.image(fused[:, :, None, None])
        return image


class OpacityDiscriminator(nn.Module):
    """Tells rendered opacity images from generated ones, given view and opacity TF."""

    def __init__(self, size: NetworkSize) -> None:
        super().__init__()
        c = size.channels
        self.view = mlp(VIEW_PARAMETERS, c(512), c(512))
        self.opacity_tf = TFEncoder([1, c(16), c(32), c(64), c(128), c(256)], c(512))
        self.image = ImageDiscriminator(
            [1, *discriminator_channels(size, size.opacity_size)], c(512)
        )
        self.score = score_head(3 * c(512), c(512))
        initialise(self)

    def forward(self, view: Tensor, opacity_tf: Tensor, image: Tensor) -> Tensor:
        """Logits (N, 1), positive for "rendered", of images (N, 1, S, S)."""
        logits: Tensor = self.score(
            concatenate(self.view(view), self.opacity_tf(opacity_tf[:, None]), self.image(image))
        )
        return logits


def discriminator_channels(size: NetworkSize, image_size: int) -> list[int]:
    """Channels after each halving of an image down to 4 x 4 pixels."""
    halvings = int(math.log2(image_size // 4))
    full = [512, 256, 128, 64, 64, 32]
    full += [32] * (halvings - len(full))
    return [size.channels(n) for n in reversed(full[:halvings])]
