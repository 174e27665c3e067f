"""Opacity generator and translation generator combined into one generator."""

from __future__ import annotations

from torch import Tensor

from model.networks.generator_network import GeneratorNetwork, OpacityNetwork
from model.networks.paper.opacity import OpacityGenerator
from model.networks.paper.translation import TranslationGenerator
from model.networks.size import NetworkSize
from model.scene.view import VIEW_PARAMETERS


class TwoStageGenerator(GeneratorNetwork):
    """Opacity generator followed by the translation generator.

    No tensor is detached: gradients by the opacity TF flow through both the
    opacity image and the latent code that enters the translation.

    Parameters
    ----------
    size : NetworkSize
    opacity : OpacityNetwork, optional
    translation : TranslationGenerator, optional
        Networks to combine; by default the paper's, with initial weights.
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
        """Opacity generator's features of the view, and translation's code of all conditions."""
        view = conditions[:, :VIEW_PARAMETERS]
        return *self.opacity.encode_view(view), self.translation.view(conditions)

    def encode_color(self, color_tf: Tensor) -> Tensor:
        """Codes (N, channels) of colour TFs (N, 3, 256)."""
        code: Tensor = self.translation.color_tf(color_tf)
        return code

    def decode(
        self, view_features: tuple[Tensor, ...], latent: Tensor, color: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Generate the opacity image, then translate it to the colour image."""
        *opacity_features, view = view_features
        opacity_image = self.opacity.decode_image(tuple(opacity_features), latent)
        return self.translation.decode(view, latent, color, opacity_image), opacity_image
