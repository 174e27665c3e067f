"""Batch-norm statistics of averaged weights.

While a network learns, its weights waver about their average, and what they
waver adds to the variance within its layers. The averaged network lacks that
part, but an average of the statistics has it: its layers' outputs are scaled
down too far, the more so the higher the learning rate. So the statistics of an
averaged network are taken anew, from training samples that it draws.
"""

from __future__ import annotations

import copy

import torch
from torch import nn
from torch.optim.swa_utils import update_bn

from model.networks.generator_network import GeneratorNetwork
from model.networks.size import NetworkSize
from model.training.batch import EncodedBatch, encode_batch
from model.training.sources import SampleSource

SAMPLES = 64
"""Training samples: each has thousands of pixels; more made no difference."""

BATCH = 16


class BatchNormRecalibration:
    """Gives networks the batch-norm statistics of their own layers.

    Parameters
    ----------
    source : SampleSource
        Its first training samples are drawn.
    size : NetworkSize
    device : torch.device
    """

    def __init__(self, source: SampleSource, size: NetworkSize, device: torch.device) -> None:
        samples = source.first("train", SAMPLES)
        batch = encode_batch(samples, source.scene, size.opacity_size).to(device)
        self._batches = batch.parts(-(-len(batch) // BATCH))

    def of(self, generator: GeneratorNetwork) -> GeneratorNetwork:
        """A copy of a generator, in evaluation mode, that differs in its statistics only."""
        own = copy.deepcopy(generator)
        update_bn(self._batches, _Decoding(own))
        return own.eval()


class _Decoding(nn.Module):
    """A generator that takes a batch, as :func:`update_bn` calls it."""

    def __init__(self, generator: GeneratorNetwork) -> None:
        super().__init__()
        self.generator = generator

    def forward(self, batch: EncodedBatch) -> tuple[torch.Tensor, torch.Tensor]:
        images: tuple[torch.Tensor, torch.Tensor] = self.generator(batch.inputs)
        return images
