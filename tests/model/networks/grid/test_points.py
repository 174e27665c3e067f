"""Points that look the opacity TF up."""

from __future__ import annotations

import torch

from model.networks.grid.points import BINS, PointNetwork, RayNetwork, binned


def test_points_that_know_their_scalar_values_integrate_the_tf() -> None:
    """Where features count the scalar values around a point, a unit shows the opacity there."""
    torch.manual_seed(0)
    network = PointNetwork(BINS, 5, looked_up=1, outputs=6, code=3)
    with torch.no_grad():
        network.values.copy_(torch.eye(BINS)[None])
        # What the hidden units have come to is passed on as it is.
        network.second.weight.copy_(torch.eye(6))
        network.second.bias.zero_()
    counts = torch.rand(2, 7, BINS)
    counts /= counts.sum(dim=2, keepdim=True)
    opacities = torch.rand(2, 1, BINS)
    found = network(counts, torch.rand(2, 3), opacities)[..., 5]
    expected = torch.stack([counts[i] @ opacities[i, 0] for i in range(2)])
    torch.testing.assert_close(found, expected)


def test_lines_that_know_their_scalar_values_show_their_opacity() -> None:
    """Where features are lengths in each scalar value: one less exp(-sum of length * TF)."""
    network = RayNetwork(BINS, 2)
    with torch.no_grad():
        network.values.copy_(torch.eye(BINS).expand(2, -1, -1))
        network.bias.copy_(torch.tensor([0.0, -1e3]))
    torch.manual_seed(0)
    lengths, opacities = torch.rand(3, 5, BINS), 0.1 * torch.rand(3, 1, BINS)
    found = network(lengths, opacities)
    depth = torch.stack([lengths[i] @ opacities[i, 0] for i in range(3)])
    torch.testing.assert_close(found[..., 0], 1 - torch.exp(-depth))
    torch.testing.assert_close(found[..., 2], torch.log(1 + depth))
    # What the bias takes away is not seen.
    assert not found[..., [1, 3]].any()


def test_bins_are_means_over_neighbouring_scalar_values() -> None:
    ramp = torch.arange(256.0).expand(1, 2, 256)
    torch.testing.assert_close(binned(ramp)[0, 1], 4 * torch.arange(64.0) + 1.5)
    torch.testing.assert_close(binned(ramp, 32)[0, 1], 8 * torch.arange(32.0) + 3.5)
