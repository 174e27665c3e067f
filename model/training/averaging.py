"""Averages of a network's weights, with batch-norm statistics of their own."""

from __future__ import annotations

import copy
from typing import Generic

import torch
from torch import nn
from torch.optim.swa_utils import update_bn

from model.networks.blocks import Network
from model.networks.generator_network import GeneratorNetwork
from model.networks.size import NetworkSize
from model.training.batch import EncodedBatch, encode_batch
from model.training.sources import SampleSource


class EMA(Generic[Network]):
    """Exponential moving average (EMA) of a network, used for evaluation and saved models.

    The average, `network`, is a copy in evaluation mode, without gradients. `decay` is the weight
    of the previous average per update, in [0, 1); the first updates use a smaller one, to forget
    the initial weights soon.
    """

    def __init__(self, network: Network, decay: float) -> None:
        self.network = copy.deepcopy(network).eval().requires_grad_(False)
        self.decay = decay

    @torch.no_grad()
    def update(self, network: Network, step: int) -> None:
        """Update the average with weights and statistics after an optimization step, from 0."""
        decay = min(self.decay, (1 + step) / (10 + step))
        pairs = list(
            zip(self.network.state_dict().values(), network.state_dict().values(), strict=True)
        )
        ours, theirs = zip(*(p for p in pairs if p[0].is_floating_point()), strict=True)
        torch._foreach_lerp_(list(ours), list(theirs), 1 - decay)
        for count, newest in pairs:
            if not count.is_floating_point():
                count.copy_(newest)


SAMPLES = 64
"""Number of training samples; with thousands of pixels each, more made no difference."""

BATCH = 16


class BatchNormRecalibration:
    """Recomputes a generator's batch-norm statistics on a fixed set of training samples.

    During training the weights fluctuate about their average, which adds to the variance of layer
    outputs. The averaged network lacks this variance, but averaged statistics include it and
    scale its outputs down too far, the more so the higher the learning rate.
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
