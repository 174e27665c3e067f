"""An exponential moving average of a network's weights."""

from __future__ import annotations

import copy
from typing import Generic

import torch

from model.networks.blocks import Network


class EMA(Generic[Network]):
    """Follows a network; its average is what is evaluated and shipped.

    Parameters
    ----------
    network : torch.nn.Module
        The network to follow.
    decay : float
        Weight of the past per update, from 0 (no averaging) to below 1. The
        first updates use less, so that the first weights are soon forgotten.
    """

    def __init__(self, network: Network, decay: float) -> None:
        self.network = copy.deepcopy(network).eval().requires_grad_(False)
        self.decay = decay

    @torch.no_grad()
    def update(self, network: Network, step: int) -> None:
        """Take in the network's weights and batch-norm statistics after a step (from 0)."""
        decay = min(self.decay, (1 + step) / (10 + step))
        ours = self.network.state_dict()
        for name, value in network.state_dict().items():
            if value.is_floating_point():
                ours[name].lerp_(value, 1 - decay)
            else:
                ours[name].copy_(value)
