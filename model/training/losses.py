"""The losses that stages are made of, each a mean over weighted samples, in float32."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits

from model.encoding import EncodedBatch

LEAST_RESPONSE = 0.005
"""Added to the mean change of an image: 8 bits know no smaller ones."""


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


def response_error(fake: Tensor, real: Tensor) -> Tensor:
    """How far the response to edits of the opacity TF is from the renderer's.

    Parameters
    ----------
    fake, real : Tensor, shape (2 N, C, H, W)
        Images in [-1, 1] in pairs, before and after an edit.

    Returns
    -------
    Tensor
        Mean over the pairs of the l1 distance between both responses, over
        that of the true one from none: 1 for a generator that does not respond.
    """
    fake = fake.float()
    ours, true = fake[1::2] - fake[::2], real[1::2] - real[::2]
    size = true.abs().flatten(1).mean(dim=1)
    return ((ours - true).abs().flatten(1).mean(dim=1) / (size + LEAST_RESPONSE)).mean()
