"""What every network can do that draws images from view and transfer functions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

from torch import Tensor, nn

from model.networks.codec import LatentCodec


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

    def forward(self, view: Tensor, opacity_tf: Tensor) -> OpacityOutput:
        """Render from views (N, 5) and opacity TFs (N, 256), both in [-1, 1]."""
        latent = self.encode(opacity_tf)
        return OpacityOutput(self.render_latent(view, latent), self.decode(latent), latent)

    def render_latent(self, view: Tensor, latent: Tensor) -> Tensor:
        """Opacity images (N, 1, S, S) in [-1, 1] from views (N, 5) and latent codes."""
        return self.decode_image(self.encode_view(view), latent)

    @abstractmethod
    def encode_view(self, view: Tensor) -> tuple[Tensor, ...]:
        """What views (N, 5) alone decide; for all latent codes the same."""

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

    def forward(self, view: Tensor, opacity_tf: Tensor, color_tf: Tensor) -> tuple[Tensor, Tensor]:
        """Render from transfer functions.

        Parameters
        ----------
        view : Tensor, shape (N, 5)
        opacity_tf : Tensor, shape (N, 256)
        color_tf : Tensor, shape (N, 3, 256)

        Returns
        -------
        image : Tensor, shape (N, 3, S, S)
        opacity_image : Tensor, shape (N, 1, So, So)
            All values in [-1, 1], those of the arguments too.
        """
        return self.render_latent(view, self.opacity.encode(opacity_tf), color_tf)

    def render_latent(
        self, view: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Render from latent codes (N, latent_dim) instead of opacity TFs."""
        return self.decode(self.encode_view(view), latent, self.encode_color(color_tf))

    @abstractmethod
    def encode_view(self, view: Tensor) -> tuple[Tensor, ...]:
        """What views (N, 5) alone decide: it can be kept while TFs are edited."""

    @abstractmethod
    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Codes of colour TFs (N, 3, 256): they can be kept while the view moves."""

    @abstractmethod
    def decode(
        self, view_features: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Render from what :meth:`encode_view` gave, latent codes and codes of colour TFs."""
