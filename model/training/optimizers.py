"""Optimizers of networks, and learning-rate schedules."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

BETA1 = 0.5

WARM_UP = 0.03
"""Fraction of a stage over which a cosine schedule's learning rate first rises."""

LEAST_DECAY = 1e-3
"""Initial and final learning rate of a cosine schedule, as a fraction of its maximum."""


def adam(network: nn.Module, beta2: float, recorded: bool = False) -> torch.optim.Adam:
    """Return an Adam optimizer with the paper's beta1 (section 6, implementation details)."""
    parameters = list(network.parameters())
    rate: float | Tensor = 1e-3
    if recorded:
        # A number would be recorded as it is.
        rate = torch.tensor(rate, device=parameters[0].device)
    return torch.optim.Adam(parameters, rate, betas=(BETA1, beta2), fused=True, capturable=recorded)


def set_rate(optimizer: torch.optim.Optimizer, rate: float) -> None:
    """Set the learning rate of each parameter group to `rate` times the group's factor."""
    for group in optimizer.param_groups:
        if isinstance(group["lr"], Tensor):
            group["lr"].fill_(rate)
        else:
            group["lr"] = rate


def cosine_decay(progress: float) -> float:
    """Learning-rate factor of a cosine schedule at a fraction of its stage, 0..1.

    It first rises linearly, while Adam's moments cover few batches only, and then
    falls along half a cosine, so that steps become small enough to converge.
    """
    if progress < WARM_UP:
        return max(LEAST_DECAY, progress / WARM_UP)
    angle = math.pi * min(1.0, (progress - WARM_UP) / (1 - WARM_UP))
    return max(LEAST_DECAY, (1 + math.cos(angle)) / 2)


def halving_decay(progress: float, halvings: float) -> float:
    """Learning-rate factor of a rate that is halved a number of times over its stage."""
    return float(0.5 ** int(progress * halvings))
