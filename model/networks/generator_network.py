"""The interface of networks that generate images from view and transfer functions."""

from __future__ import annotations

from abc import ABC, abstractmethod

from torch import Tensor, nn

from model.networks.codec import LatentCodec
from model.networks.encoding import EncodedInputs


class GeneratorNetwork(nn.Module, ABC):
    """A differentiable function of view and transfer functions.

    It works in two steps: :meth:`features` prepares what :meth:`decode`, the larger part,
    turns into images. Only the second is given to inference libraries.

    Images depend on the opacity TF through its latent code only.
    """

    def forward(self, inputs: EncodedInputs) -> tuple[Tensor, Tensor]:
        """Generate colour and opacity images from scene inputs.

        Returns
        -------
        image : Tensor, shape (N, 3, S, S)
        opacity_image : Tensor, shape (N, 1, So, So)
            All values in [-1, 1].
        """
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
