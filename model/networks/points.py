"""What points of a feature grid show under transfer functions."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from model.networks.blocks import Modulation

BINS = 64
"""Scalar values at which points look TFs up."""


class PointNetwork(nn.Module):
    """Two layers on each point; code and opacity TF decide about the first one's weights.

    Some hidden units are modulated by a code. The others look the TF up: their
    weights are linear in it. Where a point's features tell how often each
    scalar value occurs around it, such a unit is the opacity there.

    Parameters
    ----------
    features : int
        Of each point.
    hidden : int
        Number of units that the code modulates.
    looked_up : int
        Number of units that look the TF up.
    outputs, code : int
    """

    def __init__(self, features: int, hidden: int, looked_up: int, outputs: int, code: int) -> None:
        super().__init__()
        self.first = nn.Linear(features, hidden)
        self.modulation = Modulation(code, hidden)
        self.values = nn.Parameter(torch.randn(looked_up, features, BINS) / features**0.5)
        self.second = nn.Linear(hidden + looked_up, outputs)

    def forward(self, samples: Tensor, code: Tensor, opacities: Tensor) -> Tensor:
        """Map points to features of theirs.

        Parameters
        ----------
        samples : Tensor, shape (N, points, features)
        code : Tensor, shape (N, code)
        opacities : Tensor, shape (N, 1, BINS)
            The TF.

        Returns
        -------
        Tensor, shape (N, points, outputs)
        """
        scale, shift = self.modulation.factors(code)
        # As one product for each image: points are too many to scale each of their features.
        modulated = self.first.weight.t() * (1 + scale)[:, None]
        looked_up = torch.einsum("ufb,nb->nfu", self.values, opacities[:, 0])
        weight = torch.cat([modulated, looked_up], dim=2)
        bias = self.first.bias * (1 + scale) + shift
        bias = nn.functional.pad(bias, (0, looked_up.shape[2]))
        dtype = samples.dtype
        hidden = torch.baddbmm(bias[:, None].to(dtype), samples, weight.to(dtype))
        outputs: Tensor = self.second(torch.relu_(hidden))
        return outputs


def binned(tfs: Tensor, bins: int = BINS) -> Tensor:
    """TFs (N, channels, samples) averaged over the scalar values of each bin."""
    return tfs.reshape(*tfs.shape[:2], bins, -1).mean(dim=3)
