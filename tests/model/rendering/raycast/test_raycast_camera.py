"""Rays and the min-max cells that they skip, against a search of the whole volume."""

from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import pytest

from model.compilation import compiled
from model.rendering.raycast.cells import FARTHEST, MinMaxCells
from model.rendering.raycast.rays import make_ray
from model.scene.clip_plane import CUTS_NOTHING


@compiled
def ray_of(camera, step, column, row, size):
    return make_ray(camera, step, column, row, size)


def straight_camera(eye, axis, sign, shape):
    """A camera in voxels whose only pixel looks along an axis; the near plane at 0."""
    forward, right, up = np.zeros((3, 3))
    forward[axis], right[axis - 1], up[axis - 2] = sign, 0.25, 0.25
    everything = [0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, *(np.array(shape) - 1), *CUTS_NOTHING]
    return np.concatenate([eye, forward, right, up, [0.0, 0.25**2], everything, np.zeros(6)])


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("faces", [(0, 0), (0, 1), (1, 0), (1, 1), (0.5, 0), (0.5, 0.5)])
def test_a_ray_along_a_face_or_an_edge_goes_through(axis, sign, faces):
    shape = np.array([5, 7, 9])
    eye = np.empty(3)
    eye[axis] = -10 if sign > 0 else shape[axis] + 10
    eye[axis - 1], eye[axis - 2] = np.array(faces) * (shape[[axis - 1, axis - 2]] - 1)
    camera = straight_camera(tuple(eye), axis, sign, shape)
    ray, first = ray_of(camera, 0.75, 0, 0, 1)
    length = shape[axis] - 1
    assert ray.count == np.ceil(length / 0.75)
    assert ray.count - 1 + ray.rest == pytest.approx(length / 0.75)
    assert first == pytest.approx((10 if sign > 0 else 11) + 0.75)
    assert np.isfinite([*ray.start, *ray.step, *ray.inverse, first]).all()
    end = np.array(ray.start) + ray.last * np.array(ray.step)
    for place in (np.array(ray.start), end):
        # Rounding may put it just outside, where the grid is extrapolated.
        assert (place >= -1e-6).all() and (place <= shape - 1 + 1e-6).all()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("aside", [-1e-9, 1 + 1e-9])
def test_a_ray_just_beside_a_face_misses(axis, aside):
    shape = (5, 7, 9)
    eye = np.array([2.0, 3.0, 4.0])
    eye[axis] = -10
    eye[axis - 1] = aside * (shape[axis - 1] - 1)
    ray, _ = ray_of(straight_camera(tuple(eye), axis, 1, shape), 0.5, 0, 0, 1)
    assert ray.count == 0


@pytest.mark.parametrize("tilt", [1e-300, -1e-300, 1e-40, -1e-40, 1e-12, -1e-12])
def test_a_ray_that_is_hardly_tilted_against_a_face_is_finite(tilt):
    camera = straight_camera((0.0, 3.0, -10.0), 2, 1, (5, 7, 9))
    camera[3] = tilt
    ray, first = ray_of(camera, 0.5, 0, 0, 1)
    assert np.isfinite([*ray.start, *ray.step, *ray.inverse, first, ray.rest]).all()
    # It starts on the face x = 0: one way lies the volume, the other way nothing.
    assert ray.count == (16 if tilt > 0 else 0)


EDGE = 8
BYTES = (0.0, 1.0)
"""Lowest value and bins per unit of a volume of bytes from 0 to 255."""


def extremes(scalars):
    """Lowest and highest voxel that interpolation in a cell reads, the common faces with it."""
    cells = [max(-(-(n - 1) // EDGE), 1) for n in scalars.shape]
    low, high = np.empty(cells, int), np.empty(cells, int)
    for cell in product(*map(range, cells)):
        block = scalars[tuple(slice(c * EDGE, c * EDGE + EDGE + 1) for c in cell)]
        low[cell], high[cell] = block.min(), block.max()
    return low, high


@pytest.mark.parametrize("shape", [(2, 2, 2), (9, 9, 9), (10, 9, 8), (17, 25, 33), (40, 2, 19)])
def test_distances_are_to_the_nearest_cell_with_a_bin_that_shows(shape):
    # Noise of different strength from place to place.
    rng = np.random.default_rng(0)
    strength = np.kron(rng.integers(1, 256, [-(-n // EDGE) for n in shape]), np.ones((EDGE,) * 3))
    highest = strength[tuple(map(slice, shape))]
    scalars = rng.integers(0, highest, endpoint=True).astype(np.uint8)
    with ThreadPoolExecutor(2) as executor:
        cells = MinMaxCells(scalars, BYTES, executor)
    low, high = extremes(scalars)
    assert cells.shape == low.shape[::-1]
    places = np.array(list(np.ndindex(low.shape)))
    for value in range(256):
        # One bin of tolerance on either side, for rounding; no more.
        occupied = (low - 1 <= value) & (value <= high + 1)
        found = cells.distances(np.arange(256) == value)
        assert found.dtype == np.int8
        if occupied.any():
            # Cells that touch at a corner are neighbours, too.
            apart = np.abs(places[:, None] - places[occupied.ravel()]).max(axis=-1)
            np.testing.assert_array_equal(found, apart.min(axis=1))
        else:
            assert (found == FARTHEST).all()
