"""The feature grid against torch's own interpolation and against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from scipy.interpolate import RegularGridInterpolator

from model.networks.grid.feature_grid import FeatureGrid, interpolate_grid


@pytest.fixture
def grid() -> FeatureGrid:
    torch.manual_seed(3)
    return FeatureGrid((0.4, 0.5, 0.9), 300, 5)


def test_cells_are_cubes_and_nodes_as_many_as_asked(grid: FeatureGrid) -> None:
    edges = [2 * length / n for length, n in zip(grid.extent, grid.shape, strict=True)]
    assert max(edges) < 1.3 * min(edges)
    assert len(grid.features) == np.prod(grid.shape)
    assert 200 < len(grid.features) < 450


def test_features_are_interpolated_as_by_scipy(grid: FeatureGrid) -> None:
    rng = np.random.default_rng(0)
    points = (rng.random((200, 3)) * 2 - 1) * np.array(grid.extent)
    nx, ny, nz = grid.shape
    values = grid.features.detach().numpy().reshape(nz, ny, nx, 5)
    axes = [np.linspace(-e, e, n) for e, n in zip(grid.extent, grid.shape, strict=True)]
    expected = RegularGridInterpolator(axes[::-1], values)(points[:, ::-1])
    found = grid(torch.from_numpy(points).float()).detach().numpy()
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_both_ways_of_interpolating_agree_inside_and_outside(grid: FeatureGrid) -> None:
    torch.manual_seed(0)
    points = 2.6 * torch.rand(400, 3) - 1.3
    found = grid(points * torch.tensor(grid.extent))
    expected = interpolate_grid(grid.features, points, grid.shape)
    torch.testing.assert_close(found, expected, atol=1e-5, rtol=0)
    weights = torch.randn_like(found)
    ours, theirs = (
        torch.autograd.grad((values * weights).sum(), grid.features)[0]
        for values in (found, expected)
    )
    torch.testing.assert_close(ours, theirs, atol=1e-5, rtol=0)


def test_far_outside_there_is_nothing(grid: FeatureGrid) -> None:
    far = torch.tensor([[9.0, 0, 0], [0, -9.0, 0], [torch.inf, 0, 0], [torch.nan, 0, 0]])
    assert not grid(far).any()


def test_double_precision_goes_through_torch(grid: FeatureGrid) -> None:
    points = torch.rand(20, 3) - 0.5
    expected = grid(points)
    found = grid.double()(points.double())
    assert found.dtype == torch.float64
    torch.testing.assert_close(found.float(), expected, atol=1e-5, rtol=0)
