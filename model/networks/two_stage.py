"""Opacity generator and translation generator as one function of view and transfer functions."""

from __future__ import annotations

from abc import ABC, abstractmethod

from torch import Tensor, nn

from model.networks.blocks import NetworkSize
from model.networks.opacity import OpacityGenerator, OpacityNetwork
from model.networks.translation import TranslationGenerator


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

    @abstractmethod
    def render_latent(
        self, view: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Render from latent codes (N, latent_dim) instead of opacity TFs."""


class TwoStageGenerator(GeneratorNetwork):
    """The opacity generator in front of the translation generator.

    Nothing is detached: the image depends on the opacity TF through the
    opacity image and through the latent code that enters the translation, and
    the gradient goes both ways.

    Parameters
    ----------
    size : NetworkSize
    opacity, translation : optional
        Networks to use as they are; the paper's otherwise.
    """

    def __init__(
        self,
        size: NetworkSize,
        opacity: OpacityNetwork | None = None,
        translation: TranslationGenerator | None = None,
    ) -> None:
        super().__init__()
        self.opacity = opacity or OpacityGenerator(size)
        self.translation = translation or TranslationGenerator(size)

    def render_latent(
        self, view: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Render from latent codes (N, latent_dim) instead of opacity TFs."""
        opacity_image = self.opacity.draw(view, latent)
        return self.translation(view, latent, color_tf, opacity_image), opacity_image
