"""Batch-norm recalibration of averaged weights.

During training the weights fluctuate about their average, and the fluctuation
adds to the variance of layer outputs. The averaged network lacks this variance,
but averaged batch-norm statistics include it and scale its layers' outputs down
too far, the more so the higher the learning rate. The statistics of an averaged
network are therefore recomputed on training samples.
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
"""Number of training samples; with thousands of pixels each, more made no difference."""

BATCH = 16


class BatchNormRecalibration:
    """Recomputes a generator's batch-norm statistics on a fixed set of training samples.

    Parameters
    ----------
    source : SampleSource
        Provides the first :data:`SAMPLES` training samples.
    """

    def __init__(self, source: SampleSource, size: NetworkSize, device: torch.device) -> None:
        samples = source.first("train", SAMPLES)
        batch = encode_batch(samples, source.scene, size.opacity_size, device)
        self._batches = batch.parts(-(-len(batch) // BATCH))

    def of(self, generator: GeneratorNetwork) -> GeneratorNetwork:
        """Return a recalibrated copy of a generator, in evaluation mode."""
        own = copy.deepcopy(generator)
        update_bn(self._batches, _Decoding(own))
        return own.eval()


class _Decoding(nn.Module):
    """Adapter that calls a generator with a whole batch, as :func:`update_bn` does."""

    def __init__(self, generator: GeneratorNetwork) -> None:
        super().__init__()
        self.generator = generator

    def forward(self, batch: EncodedBatch) -> tuple[torch.Tensor, torch.Tensor]:
        images: tuple[torch.Tensor, torch.Tensor] = self.generator(batch.inputs)
        return images
