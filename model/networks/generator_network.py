"""The interface of networks that generate images, and the codec of opacity TFs in them."""

from __future__ import annotations

from abc import ABC, abstractmethod

from torch import Tensor, nn

from model.networks.blocks import LEAK, TFEncoder, mlp
from model.networks.encoding import EncodedInputs
from model.networks.size import NetworkSize
from model.scene.transfer_function import TF_SAMPLES


class LatentCodec(nn.Module):
    """Encoder of opacity TFs into latent codes, and decoder of codes into opacity TFs."""

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
        """Encode opacity TFs (N, 256) in [-1, 1] as latent codes (N, latent_dim)."""
        z: Tensor = self.encoder(opacity_tf[:, None])
        return z

    def decode(self, latent: Tensor) -> Tensor:
        """Decode latent codes (N, latent_dim) into opacity TFs (N, 256) in [-1, 1]."""
        tf: Tensor = self.tf_decoder(latent)
        return tf


class GeneratorNetwork(nn.Module, ABC):
    """A differentiable function of view and transfer functions.

    It works in two steps: :meth:`features` prepares what :meth:`decode`, the larger part,
    turns into images. Only the second is given to inference libraries.

    Images depend on the opacity TF through its latent code only.
    """

    def forward(self, inputs: EncodedInputs) -> tuple[Tensor, Tensor]:
        """Generate colour and opacity images from scene inputs."""
        return self.decode(*self.features(inputs))

    @property
    @abstractmethod
    def codec(self) -> LatentCodec:
        """Encoder and decoder of opacity TFs."""

    @abstractmethod
    def features(self, inputs: EncodedInputs) -> tuple[Tensor, ...]:
        """Tensors of N rows that :meth:`decode` takes, from scene inputs."""

    @abstractmethod
    def latent_features(
        self, conditions: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, ...]:
        """Return the same from latent codes (N, latent_dim) instead of opacity TFs."""

    @abstractmethod
    def decode(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        """Colour and opacity images, as :meth:`forward` returns them."""
