"""Colours looked up in the colour TF, by an attention over scalar values."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn.functional import avg_pool1d

from model.networks.blocks import concatenate, mlp
from model.networks.size import NetworkSize
from model.scene.transfer_function import TF_SAMPLES

BINS = 64
"""Number of ranges of scalar values, of equal width, that a pixel looks at."""

KEY = 16
"""Length of the keys of scalar values and of the pixels' queries."""


class ColorAttention(nn.Module):
    """Attention of each pixel to scalar values, which gives it a mixture of their colours.

    A colour image is the opacity-weighted mean of the TF's colours along each ray. The paper's
    translation has to draw those colours from a code of 32 numbers; with this variant its
    decoder says how much of each scalar value a pixel shows, and gets the colours themselves.
    How much of a value there is also depends on the opacity TF, which is known by its code.
    """

    def __init__(self, size: NetworkSize, channels: int) -> None:
        super().__init__()
        self.query = nn.Conv2d(channels, KEY, 1)
        self.keys = nn.Parameter(torch.randn(KEY, BINS))
        self.join = nn.Conv2d(channels + 3, channels, 1)
        self.opaque = nn.Sequential(mlp(size.latent_dim, BINS), nn.Linear(BINS, BINS))

    def forward(self, x: Tensor, latent: Tensor, table: Tensor) -> Tensor:
        """Give pixels' features the colours that they look up."""
        joined: Tensor = self.join(concatenate(x, self.colors(x, latent, table)))
        return joined

    def colors(self, x: Tensor, latent: Tensor, table: Tensor) -> Tensor:
        """Colours (N, 3, H, W) that pixels look up, in scaled CIELAB, [-1, 1]."""
        height, width = x.shape[-2:]
        queries = self.query(x).flatten(2)
        scores = torch.einsum("nkp,kb->npb", queries, self.keys.to(queries.dtype)) / math.sqrt(KEY)
        scores = scores + self.opaque(latent)[:, None]
        colors = table.reshape(-1, 3, BINS).to(scores.dtype)
        mixed = torch.einsum("npb,ncb->ncp", scores.softmax(-1), colors)
        return mixed.reshape(*mixed.shape[:2], height, width)


def color_table(color_tf: Tensor) -> Tensor:
    """Mean colours (N, 3 * BINS) of ranges of scalar values of colour TFs (N, 3, 256)."""
    return avg_pool1d(color_tf, TF_SAMPLES // BINS).flatten(1)
