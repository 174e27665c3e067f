"""Optimizers of networks and feature grids, and how their learning rates fall."""

from __future__ import annotations

import math

import torch
from torch import nn

from model.networks.grid.feature_grid import FeatureGrid

BETA1 = 0.5

WARM_UP = 0.03
"""Share of a stage over which a learning rate that follows a cosine rises first."""

LEAST_DECAY = 1e-3
"""Where it starts and ends, as a share of its largest value."""


def adam(
    network: nn.Module, beta2: float, grid_rate: float = 1.0, fused: bool = True
) -> torch.optim.Adam:
    """Adam, its first beta the paper's (section 6, implementation details).

    Parameters
    ----------
    network : Module
    beta2 : float
        Decay of the squared gradients' mean.
    grid_rate : float
        Learning rate of feature grids, as a multiple of all others'.
    fused : bool
        Whether all weights are moved in one go.

    Returns
    -------
    Adam
        Each group of parameters has its multiple as "factor"; :func:`set_rate`
        gives them their rates.
    """
    grids = {id(m.features) for m in network.modules() if isinstance(m, FeatureGrid)}
    parameters = list(network.parameters())
    groups = [{"params": [p for p in parameters if id(p) not in grids], "factor": 1.0}]
    if grids:
        groups.append({"params": [p for p in parameters if id(p) in grids], "factor": grid_rate})
    return torch.optim.Adam(groups, betas=(BETA1, beta2), fused=fused)


def set_rate(optimizer: torch.optim.Optimizer, rate: float) -> None:
    """Set the learning rate, each group's times its factor."""
    for group in optimizer.param_groups:
        group["lr"] = rate * group["factor"]


def cosine_decay(progress: float) -> float:
    """What a learning rate is multiplied by at a share of its stage, 0..1.

    It rises linearly at first, while Adam's moments are still those of a few
    batches, and falls along half a cosine: steps become small enough to settle.
    """
    if progress < WARM_UP:
        return max(LEAST_DECAY, progress / WARM_UP)
    angle = math.pi * min(1.0, (progress - WARM_UP) / (1 - WARM_UP))
    return max(LEAST_DECAY, (1 + math.cos(angle)) / 2)


def halving_decay(progress: float, halvings: float) -> float:
    """The same for a rate that is halved a number of times over its stage."""
    return float(0.5 ** int(progress * halvings))
