"""Opacity generator and translation generator combined into one generator."""

from __future__ import annotations

from torch import Tensor

from model.networks.encoding import EncodedInputs
from model.networks.generator_network import GeneratorNetwork, LatentCodec
from model.networks.paper.opacity import OpacityGenerator
from model.networks.paper.translation import TranslationGenerator
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene


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
        """The opacity generator's."""
        return self.opacity

    def features(self, inputs: EncodedInputs) -> tuple[Tensor, ...]:
        """Codes of the view, one for each stage, and of both TFs."""
        latent = self.opacity.encode(inputs.opacity_tf)
        return self.latent_features(inputs.conditions, latent, inputs.color_tf)

    def latent_features(
        self, conditions: Tensor, latent: Tensor, color_tf: Tensor
    ) -> tuple[Tensor, ...]:
        """Return the same from latent codes."""
        view = self.translation.view(conditions)
        return (
            self.opacity.encode_view(conditions),
            view,
            latent,
            self.translation.encode_color(color_tf),
        )

    def decode(self, *features: Tensor) -> tuple[Tensor, Tensor]:
        """Generate the opacity image, then translate it to the colour image."""
        opacity_view, view, latent, color = features
        opacity_image = self.opacity.decode_image(opacity_view, latent)
        return self.translation.decode(view, latent, color, opacity_image), opacity_image


def build_generator(size: NetworkSize, scene: Scene) -> TwoStageGenerator:
    """Build the networks of a size for a scene's inputs, with initial weights."""
    translation = TranslationGenerator(size, condition_numbers(scene))
    return TwoStageGenerator(size, OpacityGenerator(size), translation)
