"""What points of a feature grid, and sums along lines of sight, show under an opacity TF."""

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


class RayNetwork(nn.Module):
    """Looks the opacity TF up with what lines of sight run through.

    Where features tell how far a line runs through each scalar value, a sum
    over them, weighted by the TF, is an optical depth: what shows is one less
    its negative's exponential.

    Parameters
    ----------
    features : int
        Of each line.
    units : int
        Depths that are looked up.
    """

    def __init__(self, features: int, units: int) -> None:
        super().__init__()
        self.values = nn.Parameter(4 * torch.randn(units, features, BINS) / features**0.5)
        self.bias = nn.Parameter(torch.zeros(units))

    def forward(self, sums: Tensor, opacities: Tensor) -> Tensor:
        """Map sums (N, lines, features) under TFs (N, 1, BINS) to (N, lines, 2 * units).

        The opacity that follows from each depth, 0..1, and the depth's logarithm.
        """
        with torch.autocast(sums.device.type, enabled=False):
            opacities = opacities[:, 0].to(sums.dtype)
            weight = torch.einsum("ufb,nb->nfu", self.values, opacities)
            depth = torch.relu(torch.baddbmm(self.bias.expand(len(sums), 1, -1), sums, weight))
            return torch.cat([1 - torch.exp(-depth), torch.log1p(depth)], dim=2)


def binned(tfs: Tensor, bins: int = BINS) -> Tensor:
    """TFs (N, channels, samples) averaged over the scalar values of each bin."""
    return tfs.reshape(*tfs.shape[:2], bins, -1).mean(dim=3)
