"""Opacity generator and translation generator as one function of view and transfer functions."""

from __future__ import annotations

from torch import Tensor

from model.networks.generator_network import GeneratorNetwork, OpacityNetwork
from model.networks.paper.opacity import OpacityGenerator
from model.networks.paper.translation import TranslationGenerator
from model.networks.size import NetworkSize
from model.scene.view import VIEW_PARAMETERS


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

    def encode_view(self, conditions: Tensor) -> tuple[Tensor, ...]:
        """The opacity generator's features of the view, and the translation's of all."""
        view = conditions[:, :VIEW_PARAMETERS]
        return *self.opacity.encode_view(view), self.translation.view(conditions)

    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Codes (N, channels) of colour TFs (N, 3, 256)."""
        code: Tensor = self.translation.color_tf(color_tf)
        return code

    def decode(
        self, view_features: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Draw the opacity image, then paint it."""
        *opacity_features, view = view_features
        opacity_image = self.opacity.decode_image(tuple(opacity_features), latent)
        return self.translation.decode(view, latent, color, opacity_image), opacity_image
