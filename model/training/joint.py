"""Joint training of the whole generator in one stage."""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor

from model.networks.generator_network import GeneratorNetwork
from model.networks.paper.translation import TranslationDiscriminator
from model.networks.size import NetworkSize
from model.training.batch import EncodedBatch
from model.training.codec_loss import CodecLoss
from model.training.ema import EMA
from model.training.execution import STANDARD, Execution
from model.training.losses import l1
from model.training.options import TrainingOptions
from model.training.stages import ColorStage


class JointStage(ColorStage):
    """Training of opacity and colour images together, with both stages' losses (Eqs. 7 and 8).

    Parameters
    ----------
    size : NetworkSize
    options : TrainingOptions
    generator : GeneratorNetwork
    conditions : int
        Number of condition values.
    codec_loss : CodecLoss
    device : torch.device
    execution : Execution
    """

    name = "joint"
    generator: GeneratorNetwork
    average: EMA[GeneratorNetwork]

    def __init__(
        self,
        size: NetworkSize,
        options: TrainingOptions,
        generator: GeneratorNetwork,
        conditions: int,
        codec_loss: CodecLoss,
        device: torch.device,
        execution: Execution = STANDARD,
    ) -> None:
        discriminator = TranslationDiscriminator(size, conditions)
        super().__init__(generator, discriminator, options.joint, options, device, execution)
        self._codec_loss = codec_loss

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, tuple[Tensor, Tensor]]:
        image, opacity_image = self.generator(batch.inputs)
        codec = self.generator.codec
        return image, (opacity_image, codec.decode(codec.encode(batch.inputs.opacity_tf)))

    def _generator_losses(self, batch: EncodedBatch, fake: Tensor, extra: Any) -> dict[str, Tensor]:
        opacity_image, decoded = extra
        codec = self.generator.codec
        return {
            "decoded_tf": self._codec_loss(codec, decoded, batch, self.steps),
            "opacity_l1": l1(opacity_image, batch.opacity_image),
            "l1": l1(fake, batch.image),
        }

    def _weights(self) -> dict[str, float]:
        return {
            "adversarial": 1.0,
            "decoded_tf": self.options.decoded_tf_weight,
            "opacity_l1": self.options.opacity_l1_weight,
            "l1": self.options.l1_weight,
        }
