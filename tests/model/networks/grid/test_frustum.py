"""Sample points of a view against the camera that the renderers take."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from model.networks.grid.frustum import Frustum, camera
from model.scene.view import FAR_DISTANCE_RADII, VIEW_ANGLE, View, ViewRange

RANGE = ViewRange()
EXTENT = (0.3, 0.5, 0.8)
VIEWS = [View(), View(30, 20, 5, 0.7), View(250, -80, -10, 0.4), View(359, 79, 3, 1.0)]


def encoded(view: View) -> torch.Tensor:
    return torch.from_numpy(view.vector(RANGE))[None]


@pytest.mark.parametrize("view", VIEWS)
def test_the_decoded_camera_is_the_views(view: View) -> None:
    right, up, back, distance = camera(encoded(view), RANGE)
    np.testing.assert_allclose(torch.cat([right, up, back]), view.basis(), atol=1e-6)
    assert distance.item() == pytest.approx(view.camera_distance(1.0), rel=1e-6)


@pytest.mark.parametrize("view", VIEWS)
def test_points_project_onto_their_pixels(view: View) -> None:
    size, planes = 6, 4
    points = Frustum(RANGE, EXTENT, planes, size).points(encoded(view))[0].double().numpy()
    right, up, back = view.basis()
    # The camera looks along -back; what it sees at a point, by the pinhole's rule.
    seen = points - view.distance * FAR_DISTANCE_RADII * back
    depth = -seen @ back
    slope = math.tan(math.radians(VIEW_ANGLE / 2))
    column = ((seen @ right) / (depth * slope) + 1) / 2 * size - 0.5
    row = (1 - (seen @ up) / (depth * slope)) / 2 * size - 0.5
    np.testing.assert_allclose(column, np.broadcast_to(np.arange(size), column.shape), atol=1e-4)
    expected = np.broadcast_to(np.arange(size)[:, None], row.shape)
    np.testing.assert_allclose(row, expected, atol=1e-4)


@pytest.mark.parametrize("view", VIEWS)
def test_planes_cover_the_box_from_front_to_back(view: View) -> None:
    planes = 8
    points = Frustum(RANGE, EXTENT, planes, 2).points(encoded(view))[0].double().numpy()
    back = view.basis()[2]
    towards = (points @ back).mean(axis=(1, 2))
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * EXTENT
    front = (corners @ back).max()
    step = 2 * front / planes
    np.testing.assert_allclose(towards, front - step * (np.arange(planes) + 0.5), atol=1e-6)


def test_nothing_lies_behind_a_camera_inside_the_volume() -> None:
    wide = ViewRange(nearest=0.01)
    view = torch.from_numpy(View(distance=0.02).vector(wide))[None]
    points = Frustum(wide, EXTENT, 16, 4).points(view)[0]
    eye = -0.02 * FAR_DISTANCE_RADII
    behind = points[points[..., 1] < eye]
    assert behind[:, 0].abs().max() == behind[:, 2].abs().max() == 0
