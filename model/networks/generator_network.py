"""What every network can do that draws images from view and transfer functions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

from torch import Tensor, nn

from model.networks.codec import LatentCodec
from model.networks.encoding import EncodedInputs
from model.scene.view import VIEW_PARAMETERS


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


class OpacityNetwork(LatentCodec, ABC):
    """What every opacity generator can do."""

    def forward(self, inputs: EncodedInputs) -> OpacityOutput:
        """Render from scene inputs; of the conditions the view alone decides about opacity."""
        latent = self.encode(inputs.opacity_tf)
        image = self.render_latent(inputs.conditions, latent)
        return OpacityOutput(image, self.decode(latent), latent)

    def render_latent(self, conditions: Tensor, latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) in [-1, 1] from conditions (N, C) and latent codes."""
        return self.decode_image(self.encode_view(conditions[:, :VIEW_PARAMETERS]), latent)

    @abstractmethod
    def encode_view(self, view: Tensor) -> tuple[Tensor, ...]:
        """Features of views (N, 5); for all latent codes the same."""

    @abstractmethod
    def decode_image(self, view_features: tuple[Tensor, ...], latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) from what :meth:`encode_view` gave and latent codes."""


class GeneratorNetwork(nn.Module, ABC):
    """A differentiable function of view and transfer functions.

    Attributes
    ----------
    opacity : OpacityNetwork
        Encodes the opacity TF and draws the opacity image.
    """

    opacity: OpacityNetwork

    def forward(self, inputs: EncodedInputs) -> tuple[Tensor, Tensor]:
        """Render from scene inputs.

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
        """Render from latent codes (N, latent_dim) instead of opacity TFs."""
        return self.decode(self.encode_view(conditions), latent, self.encode_color(color_tf))

    @abstractmethod
    def encode_view(self, conditions: Tensor) -> tuple[Tensor, ...]:
        """Features of conditions (N, C): they can be kept while TFs are edited."""

    @abstractmethod
    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Codes of colour TFs (N, 3, 256): they can be kept while the view moves."""

    @abstractmethod
    def decode(
        self, view_features: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Render from what :meth:`encode_view` gave, latent codes and codes of colour TFs."""
