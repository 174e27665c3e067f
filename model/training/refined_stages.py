"""Training of the generator that refines a coarse volume: its codec, then its refiner.

Neither needs the other: the codec learns from random TFs without images, and the refiner,
where there is one, from images of the coarse volume under the true TFs.
"""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from model.networks.codec import LatentCodec
from model.networks.refined.refined_generator import RefinedGenerator
from model.networks.refined.refiner import Refiner
from model.scene.scene import Scene
from model.training.batch import EncodedBatch
from model.training.codec_loss import CodecLoss
from model.training.execution import STANDARD, Execution
from model.training.losses import l1
from model.training.options import TrainingOptions
from model.training.stage import Stage


class CodecStage(Stage):
    """Training of the latent codec by random TFs, as many in each step as a batch has samples.

    Parameters
    ----------
    codec : LatentCodec
    scene : Scene
        Determines the distribution of random TFs.
    options : TrainingOptions
    device : torch.device
    execution : Execution
    """

    name = "codec"
    needs_images = False
    generator: LatentCodec

    def __init__(
        self,
        codec: LatentCodec,
        scene: Scene,
        options: TrainingOptions,
        device: torch.device,
        execution: Execution = STANDARD,
    ) -> None:
        super().__init__(codec, None, options.codec, options, device, execution)
        drawn = replace(options, unrendered_tfs=options.codec.batch_size)
        self._codec_loss = CodecLoss(scene, drawn)

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, None]:
        return batch.image, None

    def _generator_losses(
        self, batch: EncodedBatch, fake: Tensor, extra: None
    ) -> dict[str, Tensor]:
        loss = self._codec_loss.without_images(self.generator, self.steps, self.device)
        return {"decoded_tf": loss}

    def _weights(self) -> dict[str, float]:
        return {"decoded_tf": self.options.decoded_tf_weight}


class RefinerStage(Stage):
    """Training of the refiner by an l1 loss on colours.

    Parameters
    ----------
    network : RefinedGenerator
        Draws the coarse volume.
    refiner : Refiner
        The network's.
    options : TrainingOptions
    device : torch.device
    execution : Execution
    """

    name = "refiner"
    generator: Refiner

    def __init__(
        self,
        network: RefinedGenerator,
        refiner: Refiner,
        options: TrainingOptions,
        device: torch.device,
        execution: Execution = STANDARD,
    ) -> None:
        super().__init__(refiner, None, options.refiner, options, device, execution)
        self._network = network.to(device)

    def _generate(self, batch: EncodedBatch) -> tuple[Tensor, None]:
        with torch.no_grad():
            (images,) = self._network.features(batch.inputs)
        return 2 * self.generator(images) - 1, None

    def _generator_losses(
        self, batch: EncodedBatch, fake: Tensor, extra: None
    ) -> dict[str, Tensor]:
        return {"l1": l1(fake, batch.image)}

    def _weights(self) -> dict[str, float]:
        return {"l1": self.options.l1_weight}
