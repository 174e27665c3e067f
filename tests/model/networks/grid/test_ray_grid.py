"""Sums along lines of sight, against lengths and places worked out from the camera."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from model.networks.grid.ray_grid import RayGrid, project_rays
from model.networks.grid.ray_kernels import FEATURES
from model.networks.grid.rays import UNIT, lines_of_sight
from model.scene.scene import Scene
from model.scene.view import VIEW_ANGLE, View

SIZE = 16
PROPORTIONS = (0.5, 0.4, 0.7)
VIEWS = [View(), View(40, 30, 5, 0.8), View(200, -60, -8, 0.6)]


def ray_grid(scene: Scene, nodes: int = 500) -> RayGrid:
    torch.manual_seed(0)
    return RayGrid(replace(scene, proportions=PROPORTIONS), nodes, SIZE)


def encoded(view: View, scene: Scene) -> torch.Tensor:
    return torch.from_numpy(view.vector(scene.view_range))[None].float()


def chords(view: View) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where each pixel's line of sight enters and leaves the volume, (S, S, 3) each; or NaN."""
    right, up, back = view.basis()
    camera = view.camera_distance(1.0) * back
    across = ((np.arange(SIZE) + 0.5) / SIZE * 2 - 1) * math.tan(math.radians(VIEW_ANGLE / 2))
    towards = across[None, :, None] * right - across[:, None, None] * up - back
    with np.errstate(divide="ignore"):
        faces = np.stack([(s * np.array(PROPORTIONS) - camera) / towards for s in (-1, 1)])
    enter = np.maximum(faces.min(axis=0).max(axis=-1), 0)
    leave = faces.max(axis=0).min(axis=-1)
    hit = (leave > enter)[..., None]
    ends = (camera + t[..., None] * towards for t in (enter, leave))
    first, last = (np.where(hit, end, np.nan) for end in ends)
    return first, last


@pytest.mark.parametrize("view", [*VIEWS, View(20, 70, 0, 0.1)])
def test_ones_add_up_to_the_length_in_the_volume(scene: Scene, view: View) -> None:
    """Also where the camera is inside: what lies behind it does not count."""
    near = replace(scene.view_range, nearest=0.1)
    grid = ray_grid(replace(scene, view_range=near))
    with torch.no_grad():
        grid.grid.features.fill_(1.0)
        sums = grid(torch.from_numpy(view.vector(near))[None].float())
    nodes = [n - 1 for n in grid.grid.shape]
    spacing = math.prod(2 * e / n for e, n in zip(PROPORTIONS, nodes, strict=True)) ** (1 / 3)
    first, last = chords(view)
    expected = np.nan_to_num(np.linalg.norm(last - first, axis=-1)) / spacing / UNIT
    assert expected.max() > 0.1
    found = sums.reshape(SIZE, SIZE, FEATURES).numpy()
    np.testing.assert_allclose(found, np.repeat(expected[..., None], FEATURES, 2), atol=2e-4)


@pytest.mark.parametrize("view", VIEWS)
def test_places_add_up_to_the_middle_of_each_line(scene: Scene, view: View) -> None:
    grid = ray_grid(scene)
    shape = grid.grid.shape
    axes = [torch.linspace(-e, e, n) for e, n in zip(PROPORTIONS, shape, strict=True)]
    z, y, x = torch.meshgrid(*axes[::-1], indexing="ij")
    with torch.no_grad():
        grid.grid.features.zero_()
        places = torch.stack([x, y, z, torch.ones_like(x)], dim=-1)
        grid.grid.features[:, :4] = places.reshape(-1, 4)
        sums = grid(encoded(view, scene)).reshape(SIZE, SIZE, FEATURES).numpy()
    first, last = chords(view)
    length = sums[..., 3:4]
    seen = (length[..., 0] > 0.02) & ~np.isnan(first[..., 0])
    assert seen.sum() > 20
    middle = ((first + last) / 2)[seen]
    np.testing.assert_allclose(sums[seen][:, :3] / length[seen], middle, atol=1e-4)


def test_both_ways_of_summing_up_agree(scene: Scene) -> None:
    grid = ray_grid(scene)
    view = torch.cat([encoded(v, scene) for v in VIEWS])
    features, shape = grid.grid.features, grid.grid.shape
    rays = lines_of_sight(view, scene.view_range, PROPORTIONS, shape, SIZE)
    ours, theirs = grid(view), project_rays(features, rays, shape).reshape(3, -1, FEATURES)
    torch.testing.assert_close(ours, theirs, atol=1e-4, rtol=0)
    weights = torch.randn_like(ours)
    gradients = [torch.autograd.grad((s * weights).sum(), features)[0] for s in (ours, theirs)]
    assert gradients[0].abs().max() > 0.1
    torch.testing.assert_close(*gradients, atol=1e-3, rtol=0)


def test_double_precision_goes_through_torch(scene: Scene) -> None:
    grid = ray_grid(scene)
    view = encoded(VIEWS[1], scene)
    expected = grid(view)
    found = grid.double()(view.double())
    assert found.dtype == torch.float64
    torch.testing.assert_close(found.float(), expected, atol=1e-4, rtol=0)
