"""The paper's networks (section 4.2): the opacity GAN, the translation GAN, and both as one."""

import math
from itertools import pairwise

import torch
from torch import Tensor, nn

from model.networks.blocks import (
    LEAK,
    DoublingConv2d,
    ImageDiscriminator,
    Modulation,
    ResidualBlock,
    TFEncoder,
    initialize,
    mlp,
    score_head,
)
from model.networks.generator_network import EncodedInputs, GeneratorNetwork, LatentCodec
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene
from model.scene.view import VIEW_PARAMETERS


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
        # Of all blocks except the last, whose output is the image.
        modulated = outputs[1:-1] if size.modulation else []
        self.modulations = nn.ModuleList(Modulation(c(512), n) for n in modulated)
        initialize(self)

    def forward(self, inputs: EncodedInputs) -> tuple[Tensor, Tensor]:
        """Generate opacity images from views, the first of the conditions, and decoded TFs."""
        latent = self.encode(inputs.opacity_tf)
        return self.decode_image(self.encode_view(inputs.conditions), latent), self.decode(latent)

    def encode_view(self, conditions: Tensor) -> Tensor:
        """Codes (N, channels) of the view parameters, the first of the conditions (N, C)."""
        code: Tensor = self.view(conditions[:, :VIEW_PARAMETERS])
        return code

    def decode_image(self, view: Tensor, latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) in [-1, 1] from codes of views and latent codes."""
        fused = self.merge(torch.cat([view, self.latent(latent)], 1))
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
        logits: Tensor = self.score(torch.cat([view, opacity_tf, self.image(image)], 1))
        return logits


def discriminator_channels(size: NetworkSize, image_size: int) -> list[int]:
    """Channels after each halving of an image down to 4 x 4 pixels."""
    halvings = int(math.log2(image_size // 4))
    full = [512, 256, 128, 64, 64, 32]
    full += [32] * (halvings - len(full))
    return [size.channels(n) for n in reversed(full[:halvings])]


FUSION_SIZE = 8  # width and height of the feature map that is fused with the codes of view and TFs
FUSION_BLOCKS = 4
COLOR_CODE = 32  # length of the colour TF's bottleneck code, independent of the network's width


class BottleneckBlock(nn.Module):
    """Residual block of three convolutions; the middle one, 3 x 3, has half of the channels."""

    def __init__(self, channels_in: int, channels_out: int) -> None:
        super().__init__()
        inner_in, inner_out = channels_in // 2, channels_out // 2
        self.body = nn.Sequential(
            nn.Conv2d(channels_in, inner_in, 1, bias=False),
            nn.BatchNorm2d(inner_in),
            nn.ReLU(),
            nn.Conv2d(inner_in, inner_out, 3, padding=1, bias=False),
            nn.BatchNorm2d(inner_out),
            nn.ReLU(),
            nn.Conv2d(inner_out, channels_out, 1, bias=False),
            nn.BatchNorm2d(channels_out),
        )
        self.shortcut: nn.Module = nn.Identity()
        if channels_in != channels_out:
            self.shortcut = nn.Sequential(
                nn.Conv2d(channels_in, channels_out, 1, bias=False), nn.BatchNorm2d(channels_out)
            )
        self.activation = nn.ReLU()

    def forward(self, x: Tensor) -> Tensor:
        """Map (N, channels_in, H, W) to (N, channels_out, H, W)."""
        y: Tensor = self.activation(self.body(x) + self.shortcut(x))
        return y


class TranslationGenerator(nn.Module):
    """Generator of colour images: encoder of the opacity image, fusion, decoder with skips."""

    def __init__(self, size: NetworkSize, conditions: int = VIEW_PARAMETERS) -> None:
        super().__init__()
        c = size.channels
        self.view = mlp(conditions, c(256), c(256))
        self.latent = mlp(size.latent_dim, c(256))
        # Of colour TFs (N, 3, 256), through a bottleneck.
        color_encoder = TFEncoder([3, c(16), c(32), c(64), c(128), c(128)], c(256), bias=False)
        self.color_tf = nn.Sequential(color_encoder, mlp(c(256), COLOR_CODE, c(256)))
        # Channels of the opacity image's encoding, from the first halving down to 8 x 8 pixels.
        halvings = int(math.log2(size.opacity_size // FUSION_SIZE))
        encoded = [c(256 // 2**i) for i in reversed(range(halvings))]
        self.encoder = nn.ModuleList(
            _halve(a, b, norm=i > 0) for i, (a, b) in enumerate(pairwise([1, *encoded]))
        )
        fused = 3 * c(256) + encoded[-1]
        self.fusion = nn.Sequential(
            *(BottleneckBlock(fused, fused) for _ in range(FUSION_BLOCKS - 1)),
            BottleneckBlock(fused, encoded[-1]),
        )
        # At 16, 32 and 64 pixels; all but the first have a skip connection from the encoder.
        ascending = encoded[::-1]
        skips = [0, *ascending[1:]]
        outputs = [*ascending[1:], c(64)]
        self.decoder = nn.ModuleList(
            ResidualBlock(a + skip, b, doubles=True)
            for a, skip, b in zip([ascending[0], *outputs[:-1]], skips, outputs, strict=True)
        )
        doublings = int(math.log2(size.image_size // size.opacity_size))
        last = c(64) if doublings < 2 else c(32)
        self.paint = _painter(c(64), last, doublings)
        color = nn.Conv2d(last, 3, 3, padding=1)
        self.color = nn.Sequential(color, nn.Tanh())
        # None at full size, where it would take a fifth of a training step.
        modulated = outputs if size.modulation else []
        self.modulations = nn.ModuleList(Modulation(3 * c(256), n) for n in modulated)
        initialize(self)
        if size.modulation:
            # With small initial weights, images stay grey for long.
            nn.init.kaiming_normal_(color.weight)

    def forward(
        self, conditions: Tensor, latent: Tensor, color_tf: Tensor, opacity: Tensor
    ) -> Tensor:
        """Generate colour images."""
        return self.decode(self.view(conditions), latent, self.color_tf(color_tf), opacity)

    def decode(self, view: Tensor, latent: Tensor, color: Tensor, opacity: Tensor) -> Tensor:
        """Generate from codes of conditions, (N, channels), and of colour TFs."""
        encodings = [opacity]
        for halve in self.encoder:
            encodings.append(halve(encodings[-1]))
        codes = torch.cat([view, self.latent(latent), color], 1)
        tiled = codes[:, :, None, None].expand(-1, -1, FUSION_SIZE, FUSION_SIZE)
        x = self.fusion(torch.cat([encodings[-1], tiled], 1))
        for i, double in enumerate(self.decoder):
            x = double(x if i == 0 else torch.cat([x, encodings[-1 - i]], 1))
            if self.modulations:
                x = self.modulations[i](x, codes)
        image: Tensor = self.color(self.paint(x))
        return image


class TranslationDiscriminator(nn.Module):
    """Discriminator of rendered and generated colour images, given conditions and both TFs."""

    def __init__(self, size: NetworkSize, conditions: int = VIEW_PARAMETERS) -> None:
        super().__init__()
        c = size.channels
        tf_channels = [c(16), c(32), c(64), c(128), c(128)]
        self.view = mlp(conditions, c(256), c(256))
        self.opacity_tf = TFEncoder([1, *tf_channels], c(256))
        self.color_tf = TFEncoder([3, *tf_channels], c(256))
        self.image = ImageDiscriminator([3, *color_discriminator_channels(size)], c(512))
        self.score = score_head(3 * c(256) + c(512), c(512))
        initialize(self)

    def forward(self, inputs: EncodedInputs, image: Tensor) -> Tensor:
        """Logits (N, 1), positive for "rendered", of images (N, 3, S, S)."""
        logits: Tensor = self.score(
            torch.cat(
                [
                    self.view(inputs.conditions),
                    self.opacity_tf(inputs.opacity_tf[:, None]),
                    self.color_tf(inputs.color_tf),
                    self.image(image),
                ],
                1,
            )
        )
        return logits


def color_discriminator_channels(size: NetworkSize) -> list[int]:
    """Channels after each halving of a colour image down to 4 x 4 pixels."""
    extra = int(math.log2(size.image_size // size.opacity_size))
    halvings = int(math.log2(size.opacity_size // 4))
    before = [32] * (extra - 1) + [64] * min(extra, 1)
    first = 128 if extra else 64
    return [size.channels(n) for n in [*before, *(min(512, first * 2**i) for i in range(halvings))]]


def _halve(channels_in: int, channels_out: int, norm: bool) -> nn.Sequential:
    layers: list[nn.Module] = [nn.Conv2d(channels_in, channels_out, 4, stride=2, padding=1)]
    if norm:
        layers.append(nn.BatchNorm2d(channels_out))
    return nn.Sequential(*layers, nn.LeakyReLU(LEAK))


def _painter(channels_in: int, channels: int, doublings: int) -> nn.Sequential:
    """Return layers from decoder to RGB features with this many doublings of the size."""
    layers: list[nn.Module] = []
    for _ in range(doublings - 1):
        layers.append(ResidualBlock(channels_in, channels, doubles=True))
        channels_in = channels
    last = nn.Conv2d(channels_in, channels_in, 3, padding=1)
    if doublings:
        last = DoublingConv2d(channels_in, channels_in)
    layers += [last, nn.BatchNorm2d(channels_in), nn.ReLU()]
    return nn.Sequential(*layers)


class TwoStageGenerator(GeneratorNetwork):
    """Opacity generator followed by the translation generator.

    No tensor is detached: gradients by the opacity TF flow through both the opacity image and the
    latent code that enters the translation.
    """

    def __init__(
        self,
        size: NetworkSize,
        opacity: OpacityGenerator | None = None,
        translation: TranslationGenerator | None = None,
    ) -> None:
        super().__init__()
        self.opacity = opacity or OpacityGenerator(size)
        self.translation = translation or TranslationGenerator(size)

    @property
    def codec(self) -> LatentCodec:
        """The opacity generator's codec."""
        return self.opacity

    def features(self, inputs: EncodedInputs) -> tuple[Tensor, ...]:
        """Codes of the view, one for each stage, and of both TFs."""
        latent = self.opacity.encode(inputs.opacity_tf)
        return self.latent_features(inputs.conditions, latent, inputs.color_tf)

    def latent_features(
        self, conditions: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, ...]:
        """See :meth:`GeneratorNetwork.latent_features`."""
        views = self.opacity.encode_view(conditions), self.translation.view(conditions)
        return *views, latent, self.translation.color_tf(color_tf)

    def decode(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        """Generate the opacity image, then translate it to the colour image."""
        opacity_view, view, latent, color = features
        opacity_image = self.opacity.decode_image(opacity_view, latent)
        return self.translation.decode(view, latent, color, opacity_image), opacity_image


def build_generator(size: NetworkSize, scene: Scene) -> TwoStageGenerator:
    """Build the networks of a size for a scene's inputs, with initial weights."""
    translation = TranslationGenerator(size, condition_numbers(scene))
    return TwoStageGenerator(size, OpacityGenerator(size), translation)
