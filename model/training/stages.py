"""The paper's two training stages: generated images, discriminators and losses."""

from __future__ import annotations

import torch
from torch import Tensor

from model.networks.names import Precision
from model.networks.paper.opacity import OpacityDiscriminator, OpacityGenerator
from model.networks.paper.translation import TranslationDiscriminator, TranslationGenerator
from model.networks.size import NetworkSize
from model.training.batch import EncodedBatch
from model.training.codec_loss import CodecLoss
from model.training.ema import EMA
from model.training.losses import l1
from model.training.options import TrainingOptions
from model.training.stage import Stage


class OpacityStage(Stage):
    """Stage 1: the opacity GAN with its decoded-TF loss (paper, Eq. 8).

    Parameters
    ----------
    opacity : OpacityGenerator
        The generator.
    """

    name = "opacity"
    generator: OpacityGenerator
    average: EMA[OpacityGenerator]

    def __init__(
        self,
        size: NetworkSize,
        options: TrainingOptions,
        opacity: OpacityGenerator,
        codec_loss: CodecLoss,
        device: torch.device,
        precision: Precision = "float32",
    ) -> None:
        discriminator = OpacityDiscriminator(size)
        super().__init__(opacity, discriminator, options.opacity, options, device, precision)
        self._codec_loss = codec_loss

    def _real(self, batch: EncodedBatch) -> Tensor:
        return batch.opacity_image

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, Tensor]:
        output = self.generator(batch.inputs)
        return output.image, output.decoded_tf

    def _judge(self, batch: EncodedBatch, image: Tensor) -> Tensor:
        assert self.discriminator is not None
        logits: Tensor = self.discriminator(batch.inputs, image)
        return logits

    def _generator_losses(
        self, batch: EncodedBatch, fake: Tensor, extra: Tensor
    ) -> dict[str, Tensor]:
        return {
            "decoded_tf": self._codec_loss(self.generator, extra, batch, self.steps),
            "opacity_l1": l1(fake, batch.opacity_image),
        }

    def _weights(self) -> dict[str, float]:
        return {
            "adversarial": 1.0,
            "decoded_tf": self.options.decoded_tf_weight,
            "opacity_l1": self.options.opacity_l1_weight,
        }


class ColorStage(Stage):
    """Stage that trains colour images against a :class:`TranslationDiscriminator`."""

    discriminator: TranslationDiscriminator | None

    def _real(self, batch: EncodedBatch) -> Tensor:
        return batch.image

    def _judge(self, batch: EncodedBatch, image: Tensor) -> Tensor:
        assert self.discriminator is not None
        logits: Tensor = self.discriminator(batch.inputs, image)
        return logits

    def _feature_losses(self, batch: EncodedBatch, fake: Tensor) -> dict[str, Tensor]:
        if not self.options.feature_matching_weight:
            return {}
        assert self.discriminator is not None
        with torch.no_grad():
            real = self.discriminator.image.features(batch.image)
        pairs = zip(self.discriminator.image.features(fake), real, strict=True)
        return {"feature_matching": torch.stack([l1(a, b.float()) for a, b in pairs]).mean()}


class TranslationStage(ColorStage):
    """Stage 2: the translation GAN with its l1 loss (paper, Eq. 9), stage 1 frozen.

    Parameters
    ----------
    opacity : OpacityGenerator
        The trained generator of stage 1; encodes opacity TFs.
    conditions : int
        Number of condition values.
    """

    name = "translation"
    generator: TranslationGenerator

    def __init__(
        self,
        size: NetworkSize,
        options: TrainingOptions,
        opacity: OpacityGenerator,
        conditions: int,
        device: torch.device,
        precision: Precision = "float32",
    ) -> None:
        super().__init__(
            TranslationGenerator(size, conditions),
            TranslationDiscriminator(size, conditions),
            options.translation,
            options,
            device,
            precision,
        )
        self.opacity = opacity

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, None]:
        with torch.no_grad():
            latent = self.opacity.encode(batch.inputs.opacity_tf)
        conditions, _, color_tf = batch.inputs
        return self.generator(conditions, latent, color_tf, batch.opacity_image), None

    def _generator_losses(
        self, batch: EncodedBatch, fake: Tensor, extra: None
    ) -> dict[str, Tensor]:
        return {"l1": l1(fake, batch.image)}

    def _weights(self) -> dict[str, float]:
        return {
            "adversarial": 1.0,
            "feature_matching": self.options.feature_matching_weight,
            "l1": self.options.l1_weight,
        }
