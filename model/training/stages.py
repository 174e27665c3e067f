"""The training stages: generated images, discriminators and losses.

The paper trains its two networks one after the other, by :class:`OpacityStage` and
:class:`TranslationStage`; :class:`SmallStage` and :class:`JointStage` train both at once.
"""

from dataclasses import replace
from typing import Any

import torch
from torch import Tensor
from torch.nn.functional import l1_loss

from model.networks.generator_network import GeneratorNetwork
from model.networks.names import Precision
from model.networks.paper import (
    OpacityDiscriminator,
    OpacityGenerator,
    TranslationDiscriminator,
    TranslationGenerator,
    TwoStageGenerator,
)
from model.networks.size import NetworkSize
from model.scene.inputs import condition_numbers
from model.scene.scene import Scene
from model.training.batch import EncodedBatch
from model.training.codec_loss import CodecLoss
from model.training.options import TrainingOptions
from model.training.stage import EMA, Setup, Stage


def _l1(fake: Tensor, real: Tensor) -> Tensor:
    """Mean absolute difference of images (N, C, H, W) in float32 (paper, Eq. 9)."""
    return l1_loss(fake.float(), real)


class OpacityStage(Stage):
    """Stage 1: the opacity GAN with its decoded-TF loss (paper, Eq. 8)."""

    name = "opacity"
    generator: OpacityGenerator
    average: EMA[OpacityGenerator]

    def __init__(self, setup: Setup) -> None:
        super().__init__(OpacityGenerator(setup.size), OpacityDiscriminator(setup.size), setup)

    def _real(self, batch: EncodedBatch) -> Tensor:
        return batch.opacity_image

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, Tensor]:
        image, decoded_tf = self.generator(batch.inputs)
        return image, decoded_tf

    def _generator_losses(
        self, batch: EncodedBatch, fake: Tensor, extra: Tensor
    ) -> dict[str, Tensor]:
        return {
            "decoded_tf": self.codec_loss(self.generator, extra, batch, self.steps),
            "opacity_l1": _l1(fake, batch.opacity_image),
        }


class ColorStage(Stage):
    """Stage that trains colour images against a :class:`TranslationDiscriminator`."""

    discriminator: TranslationDiscriminator | None

    def _real(self, batch: EncodedBatch) -> Tensor:
        return batch.image


class TranslationStage(ColorStage):
    """Stage 2: the translation GAN with its l1 loss (paper, Eq. 9)."""

    name = "translation"
    generator: TranslationGenerator

    def __init__(self, setup: Setup, opacity: OpacityGenerator) -> None:
        generator = TranslationGenerator(setup.size, setup.conditions)
        super().__init__(generator, TranslationDiscriminator(setup.size, setup.conditions), setup)
        self.opacity = opacity

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, None]:
        with torch.no_grad():
            latent = self.opacity.encode(batch.inputs.opacity_tf)
        conditions, _, color_tf = batch.inputs
        return self.generator(conditions, latent, color_tf, batch.opacity_image), None

    def _generator_losses(
        self, batch: EncodedBatch, fake: Tensor, extra: None
    ) -> dict[str, Tensor]:
        return {"l1": _l1(fake, batch.image)}


class JointStage(ColorStage):
    """Training of opacity and colour images together, with both stages' losses (Eqs. 8 and 9)."""

    name = "joint"
    generator: TwoStageGenerator
    average: EMA[TwoStageGenerator]

    def __init__(self, setup: Setup) -> None:
        # The order of drawing weights is fixed: recipe and seed determine the network.
        translation = TranslationGenerator(setup.size, setup.conditions)
        generator = TwoStageGenerator(setup.size, translation=translation)
        super().__init__(generator, TranslationDiscriminator(setup.size, setup.conditions), setup)

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        opacity_view, view, latent, color = self.generator.features(batch.inputs)
        opacity_image = self.generator.opacity.decode_image(opacity_view, latent)
        image = self.generator.translation.decode(view, latent, color, opacity_image)
        return image, (opacity_image, self.generator.codec.decode(latent))

    def _generator_losses(self, batch: EncodedBatch, fake: Tensor, extra: Any) -> dict[str, Tensor]:
        opacity_image, decoded = extra
        return {
            "decoded_tf": self.codec_loss(self.generator.codec, decoded, batch, self.steps),
            "opacity_l1": _l1(opacity_image, batch.opacity_image),
            "l1": _l1(fake, batch.image),
        }

    def _prepare(self) -> None:
        self.codec_loss.prepare(self.steps, self.device)


class SmallStage(JointStage):
    """Joint training on colour images of the opacity image's size, before the full size."""

    name = "small"

    def __init__(self, setup: Setup) -> None:
        self.image_size = setup.size.opacity_size
        # The discriminator joins at the full size only.
        options = replace(setup.options, adversarial_start=1.0)
        size = replace(setup.size, image_size=self.image_size)
        super().__init__(replace(setup, size=size, options=options))


class Schedule:
    """The stages of a run by name, in order, and the fraction of the budget used at their ends."""

    def __init__(
        self,
        size: NetworkSize,
        options: TrainingOptions,
        scene: Scene,
        device: torch.device,
        precision: Precision = "float32",
    ) -> None:
        self._size = size
        torch.manual_seed(options.seed)
        self.stages: dict[str, Stage] = {}
        self.ends: dict[str, float] = {}
        loss = CodecLoss(scene, options)
        setup = Setup(size, condition_numbers(scene), options, loss, device, precision)
        if options.one_stage:
            if options.small_time_share and size.image_size > size.opacity_size:
                self.stages["small"] = SmallStage(setup)
                self.ends["small"] = options.small_time_share
            self.stages["joint"] = JointStage(setup)
            self.ends["joint"] = 1.0
        else:
            opacity = OpacityStage(setup)
            translation = TranslationStage(setup, opacity.average.network)
            self.stages = {"opacity": opacity, "translation": translation}
            self.ends = {"opacity": options.opacity_time_share, "translation": 1.0}

    @property
    def names(self) -> list[str]:
        """Names of the stages, in order."""
        return list(self.stages)

    def share(self, name: str, spent: float) -> float:
        """Fraction of a stage's part of the budget used; 1 or more when the stage is over."""
        number = self.names.index(name)
        first = self.ends[self.names[number - 1]] if number else 0.0
        return max(0.0, (spent - first) / (self.ends[name] - first))

    def begun(self, name: str) -> list[Stage]:
        """Return the stages up to and including the named one; all for "done"."""
        if name == "done":
            return list(self.stages.values())
        return list(self.stages.values())[: self.names.index(name) + 1]

    def generator(self) -> GeneratorNetwork:
        """Return the averaged networks as one generator, in evaluation mode."""
        if "joint" in self.stages:
            begun = [s for s in self.stages.values() if s.steps] or [self.stages["joint"]]
            network: GeneratorNetwork = begun[-1].average.network
            return network.eval()
        both = (self.stages[name].average.network for name in ("opacity", "translation"))
        return TwoStageGenerator(self._size, *both).eval()

    def start_from(self, generator: GeneratorNetwork) -> None:
        """Copy a trained generator's weights before the first step; its images may be smaller."""
        if "small" in self.stages:
            # The start model has learned it already.
            del self.stages["small"], self.ends["small"]
        for name, stage in self.stages.items():
            stage.start_from(generator if name == "joint" else getattr(generator, name))

    def enter(self, name: str) -> None:
        """Prepare the first step of a stage, after those before it."""
        if name == "joint" and "small" in self.stages:
            self.stages[name].start_from(self.stages["small"].average.network)
