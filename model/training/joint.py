"""Joint training of the paper's generator: opacity and colour images at once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from model.networks.names import Precision
from model.networks.paper.translation import TranslationDiscriminator
from model.networks.paper.two_stage import TwoStageGenerator
from model.networks.size import NetworkSize
from model.training.batch import EncodedBatch
from model.training.codec_loss import CodecLoss
from model.training.ema import EMA
from model.training.losses import l1
from model.training.options import TrainingOptions
from model.training.stages import ColorStage


class JointStage(ColorStage):
    """Training of opacity and colour images together, with both stages' losses (Eqs. 8 and 9).

    Parameters
    ----------
    conditions : int
        Number of condition values.
    """

    name = "joint"
    generator: TwoStageGenerator
    average: EMA[TwoStageGenerator]

    def __init__(
        self,
        size: NetworkSize,
        options: TrainingOptions,
        generator: TwoStageGenerator,
        conditions: int,
        codec_loss: CodecLoss,
        device: torch.device,
        precision: Precision = "float32",
    ) -> None:
        size, options = self._own(size, options)
        discriminator = TranslationDiscriminator(size, conditions)
        super().__init__(generator, discriminator, options.joint, options, device, precision)
        self._codec_loss = codec_loss

    def _own(
        self, size: NetworkSize, options: TrainingOptions
    ) -> tuple[NetworkSize, TrainingOptions]:
        """Size and options of this stage, from those of the whole generator."""
        return size, options

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        opacity_view, view, latent, color = self.generator.features(batch.inputs)
        opacity_image = self.generator.opacity.decode_image(opacity_view, latent)
        given = opacity_image
        if self.options.true_opacity_share:
            rendered = int(self.options.true_opacity_share * len(batch))
            given = torch.cat([batch.opacity_image[:rendered], opacity_image[rendered:]])
        image = self.generator.translation.decode(view, latent, color, given)
        return image, (opacity_image, self.generator.codec.decode(latent))

    def _generator_losses(self, batch: EncodedBatch, fake: Tensor, extra: Any) -> dict[str, Tensor]:
        opacity_image, decoded = extra
        codec = self.generator.codec
        return {
            "decoded_tf": self._codec_loss(codec, decoded, batch, self.steps),
            "opacity_l1": l1(opacity_image, batch.opacity_image),
            "l1": l1(fake, batch.image),
        }

    def _prepare(self) -> None:
        self._codec_loss.prepare(self.steps, self.device)

    def _weights(self) -> dict[str, float]:
        return {
            "adversarial": 1.0,
            "decoded_tf": self.options.decoded_tf_weight,
            "opacity_l1": self.options.opacity_l1_weight,
            "feature_matching": self.options.feature_matching_weight,
            "l1": self.options.l1_weight,
        }


class SmallStage(JointStage):
    """Joint training on colour images of the opacity image's size, before the full size.

    Its parameters are those of :class:`JointStage`: `size` and `options` are the whole generator's,
    and `generator` is one of :func:`small_size`.
    """

    name = "small"

    def _own(
        self, size: NetworkSize, options: TrainingOptions
    ) -> tuple[NetworkSize, TrainingOptions]:
        self.image_size = size.opacity_size
        # The discriminator joins at the full size only.
        return small_size(size), replace(options, joint=options.small, adversarial_start=1.0)


def small_size(size: NetworkSize) -> NetworkSize:
    """Return the size of a generator whose colour images are as small as its opacity images."""
    return replace(size, image_size=size.opacity_size)
