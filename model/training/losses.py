"""Losses of the training stages, each a mean over samples, in float32."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits, l1_loss


def l1(fake: Tensor, real: Tensor) -> Tensor:
    """Mean absolute difference of images (N, C, H, W) (paper, Eq. 9)."""
    return l1_loss(fake.float(), real)


def adversarial(logits: Tensor, target: float) -> Tensor:
    """Binary cross-entropy of logits (N, ...) against one target, in float32."""
    logits = logits.float()
    return binary_cross_entropy_with_logits(logits, torch.full_like(logits, target))
