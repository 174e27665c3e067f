"""Tables against dense numerical integration over the normal distribution."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from model.networks.refined.coarse_kernels import ENTRIES, LEVELS, SUBLEVELS
from model.networks.refined.coarse_tables import deviations, entry_table, sample_opacity
from model.networks.refined.coarse_volume import SPREADS
from model.rendering.opacity_correction import per_sample, per_sample_derivative

DISTANCE = 0.8


def tfs(seed: int) -> tuple[torch.Tensor, torch.Tensor]:
    rng = np.random.default_rng(seed)
    opacity = rng.uniform(size=(2, 256)) ** 3
    opacity[1] = 0
    opacity[1, 77] = 1  # a single bin
    return torch.from_numpy(opacity), torch.from_numpy(rng.uniform(size=(2, 3, 256)))


def test_an_entry_is_the_mean_over_a_normal_distribution() -> None:
    opacity, color = tfs(0)
    table = entry_table(opacity, color, DISTANCE).numpy()
    assert table.shape == (2, ENTRIES + 1, 4)
    alpha = per_sample(opacity.numpy(), DISTANCE)
    z = np.linspace(-8, 8, 40_001)
    weight = np.exp(-z * z / 2) / np.exp(-z * z / 2).sum()
    for spread in (1, 4, 9, SPREADS - 1):
        for mean in (0, 76, 130, 255):
            values = np.clip(mean + deviations()[spread] * z, 0, 255)
            entry = table[:, spread * LEVELS + mean * SUBLEVELS]
            for n in range(2):
                expected = weight @ np.interp(values, np.arange(256), alpha[n])
                assert entry[n, 3] == pytest.approx(expected, abs=1e-5)
                product = alpha[n] * color[n, 1].numpy()
                expected = weight @ np.interp(values, np.arange(256), product)
                assert entry[n, 1] == pytest.approx(expected, abs=1e-5)


def test_without_spread_it_is_the_tf_itself() -> None:
    opacity, color = tfs(1)
    table = entry_table(opacity, color, DISTANCE).numpy()
    alpha = per_sample(opacity.numpy(), DISTANCE)
    places = np.arange(LEVELS) / SUBLEVELS
    for n in range(2):
        expected = np.interp(places, np.arange(256), alpha[n])
        np.testing.assert_allclose(table[n, :LEVELS, 3], expected, atol=1e-6)
    assert not table[:, ENTRIES].any()


@pytest.mark.parametrize("distance", [0.25, 0.8, 1.0, 2.5])
def test_opacity_correction_and_its_derivative_at_the_extremes(distance: float) -> None:
    opacity = torch.tensor([0, 1e-7, 0.3, 0.999, 1.0], dtype=torch.float64, requires_grad=True)
    corrected = sample_opacity(opacity, distance)
    known = opacity.detach().numpy()
    np.testing.assert_allclose(corrected.detach(), per_sample(known, distance), rtol=1e-12)
    (slope,) = torch.autograd.grad(corrected.sum(), opacity)
    np.testing.assert_allclose(slope, per_sample_derivative(known, distance), rtol=1e-9)
