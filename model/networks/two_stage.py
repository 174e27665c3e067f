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

    def render_latent(
        self, view: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Render from latent codes (N, latent_dim) instead of opacity TFs."""
        return self.draw(self.see(view), latent, self.encode_color(color_tf))

    @abstractmethod
    def see(self, view: Tensor) -> tuple[Tensor, ...]:
        """What views (N, 5) alone decide: it can be kept while TFs are edited."""

    @abstractmethod
    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Codes of colour TFs (N, 3, 256): they can be kept while the view moves."""

    @abstractmethod
    def draw(
        self, seen: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Render from what :meth:`see` gave, latent codes and codes of colour TFs."""


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

    def see(self, view: Tensor) -> tuple[Tensor, ...]:
        """What the opacity generator sees, and the translation's code of the view."""
        return *self.opacity.see(view), self.translation.view(view)

    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Codes (N, channels) of colour TFs (N, 3, 256)."""
        code: Tensor = self.translation.color_tf(color_tf)
        return code

    def draw(
        self, seen: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Draw the opacity image, then paint it."""
        *seen_by_opacity, view = seen
        opacity_image = self.opacity.draw_seen(tuple(seen_by_opacity), latent)
        return self.translation.draw(view, latent, color, opacity_image), opacity_image
