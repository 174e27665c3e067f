"""The losses that stages are made of, each a mean over weighted samples, in float32."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from model.encoding import EncodedBatch


def weighted(errors: Tensor, weight: Tensor) -> Tensor:
    """Mean of errors (N, ...), each sample's with its weight (N,)."""
    return (errors.flatten(1).mean(dim=1) * weight).mean()


def l1(fake: Tensor, real: Tensor, weight: Tensor) -> Tensor:
    """Mean absolute difference of images (N, C, H, W) (paper, Eq. 8)."""
    return weighted((fake.float() - real).abs(), weight)


def decoded_tf_error(decoded: Tensor, batch: EncodedBatch) -> Tensor:
    """Mean squared difference of decoded opacity TFs (N, 256) (paper, Eq. 7)."""
    return weighted((decoded.float() - batch.opacity_tf).square(), batch.weight)


def adversarial(logits: Tensor, target: float, weight: Tensor) -> Tensor:
    """Binary cross-entropy of logits (N, ...) against one target, in float32."""
    logits = logits.float()
    errors = binary_cross_entropy_with_logits(
        logits, torch.full_like(logits, target), reduction="none"
    )
    return weighted(errors, weight)
