"""Exponential moving average (EMA) of a network's weights."""

from __future__ import annotations

import copy
from typing import Generic

import torch

from model.networks.blocks import Network


class EMA(Generic[Network]):
    """Exponential moving average (EMA) of a network, used for evaluation and saved models.

    Parameters
    ----------
    network : torch.nn.Module
        The network that is averaged; a copy is made.
    decay : float
        Weight of the previous average per update, in [0, 1); 0 disables averaging.
        The first updates use a smaller decay, to forget the initial weights soon.

    Attributes
    ----------
    network : torch.nn.Module
        The averaged network, in evaluation mode, without gradients.
    """

    def __init__(self, network: Network, decay: float) -> None:
        self.network = copy.deepcopy(network).eval().requires_grad_(False)
        self.decay = decay

    @torch.no_grad()
    def update(self, network: Network, step: int) -> None:
        """Update the average with a network's weights and batch-norm statistics.

        Parameters
        ----------
        step : int
            Number of the optimization step just done, from 0.
        """
        decay = min(self.decay, (1 + step) / (10 + step))
        pairs = list(
            zip(self.network.state_dict().values(), network.state_dict().values(), strict=True)
        )
        ours, theirs = zip(*(p for p in pairs if p[0].is_floating_point()), strict=True)
        torch._foreach_lerp_(list(ours), list(theirs), 1 - decay)
        for count, newest in pairs:
            if not count.is_floating_point():
                count.copy_(newest)
