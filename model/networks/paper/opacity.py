"""The opacity GAN (paper, section 4.2.1): opacity images from view and opacity TF."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from torch import Tensor, nn

from model.networks.blocks import (
    ImageDiscriminator,
    Modulation,
    ResidualBlock,
    TFEncoder,
    concatenate,
    initialize,
    mlp,
    score_head,
)
from model.networks.encoding import EncodedInputs
from model.networks.generator_network import LatentCodec
from model.networks.size import NetworkSize
from model.scene.view import VIEW_PARAMETERS


class OpacityOutput(NamedTuple):
    """Output of the opacity generator for N views and opacity TFs; see the fields for shapes.

    Image and decoded TF lie in [-1, 1].
    """

    image: Tensor
    decoded_tf: Tensor
    latent: Tensor


class OpacityGenerator(LatentCodec):
    """The paper's opacity generator: 2-D convolutions from latent code and view to an image."""

    def __init__(self, size: NetworkSize) -> None:
        super().__init__(size)
        c = size.channels
        self.view = mlp(VIEW_PARAMETERS, c(512), c(512))
        self.latent = mlp(size.latent_dim, c(512))
        self.merge = mlp(2 * c(512), c(512), c(512))
        doublings = int(math.log2(size.opacity_size))
        # 512 channels while the image is small, then half as many after each doubling.
        full = [min(512, 32 * 2 ** (doublings - i)) for i in range(doublings)]
        blocks: list[nn.Module] = []
        outputs = [*map(c, full), 1]
        for i, (a, b) in enumerate(pairwise(outputs)):
            # All pixels of the first block are equal, so a kernel of size 1 suffices.
            kernel = 1 if i == 0 else 3
            blocks.append(ResidualBlock(a, b, kernel, last=b == 1, doubles=True))
        self.image = nn.Sequential(*blocks, nn.Tanh())
        # Of all blocks but the last, whose output is the image.
        modulated = outputs[1:-1] if size.opacity_modulation else []
        self.modulations = nn.ModuleList(Modulation(c(512), n) for n in modulated)
        initialize(self)

    def forward(self, inputs: EncodedInputs) -> OpacityOutput:
        """Generate opacity images; of the conditions, only the view parameters are used."""
        latent = self.encode(inputs.opacity_tf)
        image = self.decode_image(self.encode_view(inputs.conditions), latent)
        return OpacityOutput(image, self.decode(latent), latent)

    def encode_view(self, conditions: Tensor) -> Tensor:
        """Codes (N, channels) of the view parameters, the first of the conditions (N, C)."""
        code: Tensor = self.view(conditions[:, :VIEW_PARAMETERS])
        return code

    def decode_image(self, view: Tensor, latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) in [-1, 1] from codes of views and latent codes."""
        fused = self.merge(concatenate(view, self.latent(latent)))
        image: Tensor = fused[:, :, None, None]
        for i, layer in enumerate(self.image):
            image = layer(image)
            if i < len(self.modulations):
                image = self.modulations[i](image, fused)
        return image


class OpacityDiscriminator(nn.Module):
    """Discriminator of rendered and generated opacity images, given view and opacity TF."""

    def __init__(self, size: NetworkSize) -> None:
        super().__init__()
        c = size.channels
        self.view = mlp(VIEW_PARAMETERS, c(512), c(512))
        self.opacity_tf = TFEncoder([1, c(16), c(32), c(64), c(128), c(256)], c(512))
        self.image = ImageDiscriminator(
            [1, *discriminator_channels(size, size.opacity_size)], c(512)
        )
        self.score = score_head(3 * c(512), c(512))
        initialize(self)

    def forward(self, inputs: EncodedInputs, image: Tensor) -> Tensor:
        """Logits (N, 1), positive for "rendered", of images (N, 1, S, S)."""
        view = self.view(inputs.conditions[:, :VIEW_PARAMETERS])
        opacity_tf = self.opacity_tf(inputs.opacity_tf[:, None])
        logits: Tensor = self.score(concatenate(view, opacity_tf, self.image(image)))
        return logits


def discriminator_channels(size: NetworkSize, image_size: int) -> list[int]:
    """Channels after each halving of an image down to 4 x 4 pixels."""
    halvings = int(math.log2(image_size // 4))
    full = [512, 256, 128, 64, 64, 32]
    full += [32] * (halvings - len(full))
    return [size.channels(n) for n in reversed(full[:halvings])]
