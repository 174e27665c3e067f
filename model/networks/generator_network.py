"""Interfaces of the networks that generate images from view and transfer functions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

from torch import Tensor, nn

from model.networks.codec import LatentCodec
from model.networks.encoding import EncodedInputs
from model.scene.view import VIEW_PARAMETERS


class OpacityOutput(NamedTuple):
    """Output of the opacity generator for N views and opacity TFs.

    Attributes
    ----------
    image : Tensor, shape (N, 1, S, S)
        Opacity image, in [-1, 1].
    decoded_tf : Tensor, shape (N, 256)
        The opacity TF decoded from the latent code, in [-1, 1].
    latent : Tensor, shape (N, latent_dim)
    """

    image: Tensor
    decoded_tf: Tensor
    latent: Tensor


class OpacityNetwork(LatentCodec, ABC):
    """Interface of opacity generators: a latent codec and a decoder of opacity images."""

    def forward(self, inputs: EncodedInputs) -> OpacityOutput:
        """Generate opacity images; of the conditions, only the view parameters are used."""
        latent = self.encode(inputs.opacity_tf)
        image = self.render_latent(inputs.conditions, latent)
        return OpacityOutput(image, self.decode(latent), latent)

    def render_latent(self, conditions: Tensor, latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) in [-1, 1] for conditions (N, C) and latent codes."""
        return self.decode_image(self.encode_view(conditions[:, :VIEW_PARAMETERS]), latent)

    @abstractmethod
    def encode_view(self, view: Tensor) -> tuple[Tensor, ...]:
        """Features of views (N, 5), independent of the latent codes."""

    @abstractmethod
    def decode_image(self, view_features: tuple[Tensor, ...], latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) from the features of :meth:`encode_view` and latent codes."""


class GeneratorNetwork(nn.Module, ABC):
    """A differentiable function of view and transfer functions.

    Attributes
    ----------
    opacity : OpacityNetwork
        Encodes the opacity TF and draws the opacity image.
    """

    opacity: OpacityNetwork

    def forward(self, inputs: EncodedInputs) -> tuple[Tensor, Tensor]:
        """Generate colour and opacity images from scene inputs.

        Returns
        -------
        image : Tensor, shape (N, 3, S, S)
        opacity_image : Tensor, shape (N, 1, So, So)
            All values in [-1, 1].
        """
        latent = self.opacity.encode(inputs.opacity_tf)
        return self.render_latent(inputs.conditions, latent, inputs.color_tf)

    def render_latent(
        self, conditions: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Generate from latent codes (N, latent_dim) instead of opacity TFs."""
        return self.decode(self.encode_view(conditions), latent, self.encode_color(color_tf))

    @abstractmethod
    def encode_view(self, conditions: Tensor) -> tuple[Tensor, ...]:
        """Features of conditions (N, C); they can be cached while TFs are edited."""

    @abstractmethod
    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Codes of colour TFs (N, 3, 256); they can be cached while the view changes."""

    @abstractmethod
    def decode(
        self, view_features: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Generate from features of :meth:`encode_view`, latent codes and codes of colour TFs."""
