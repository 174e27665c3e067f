"""Min-max cells against a search of the whole volume."""

from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import pytest

from model.rendering.raycast.cells import FARTHEST, MinMaxCells

EDGE = 8
BYTES = (0.0, 1.0)
"""Lowest value and bins per unit of a volume of bytes from 0 to 255."""


@pytest.fixture(scope="module")
def executor():
    with ThreadPoolExecutor(2) as executor:
        yield executor


def random_bytes(shape, seed=0):
    """Noise of different strength from place to place."""
    rng = np.random.default_rng(seed)
    strength = rng.integers(1, 256, [-(-n // EDGE) for n in shape])
    for axis in range(3):
        strength = np.repeat(strength, EDGE, axis)
    nz, ny, nx = shape
    return rng.integers(0, strength[:nz, :ny, :nx], endpoint=True).astype(np.uint8)


def extremes(scalars):
    """Lowest and highest voxel that interpolation in a cell reads, the common faces with it."""
    cells = [max(-(-(n - 1) // EDGE), 1) for n in scalars.shape]
    low, high = np.empty(cells, int), np.empty(cells, int)
    for cell in product(*map(range, cells)):
        block = scalars[tuple(slice(c * EDGE, c * EDGE + EDGE + 1) for c in cell)]
        low[cell], high[cell] = block.min(), block.max()
    return low, high


def only(value):
    return np.arange(256) == value


@pytest.mark.parametrize("shape", [(2, 2, 2), (9, 9, 9), (10, 9, 8), (17, 25, 33), (40, 2, 19)])
def test_distances_are_to_the_nearest_cell_with_a_bin_that_shows(shape, executor):
    scalars = random_bytes(shape)
    cells = MinMaxCells(scalars, BYTES, executor)
    low, high = extremes(scalars)
    assert cells.shape == low.shape[::-1]
    places = np.array(list(np.ndindex(low.shape)))
    for value in range(256):
        # One bin of tolerance on either side, for rounding; no more.
        occupied = (low - 1 <= value) & (value <= high + 1)
        found = cells.distances(only(value))
        assert found.dtype == np.int8
        if occupied.any():
            # Cells that touch at a corner are neighbours, too.
            apart = np.abs(places[:, None] - places[occupied.ravel()]).max(axis=-1)
            np.testing.assert_array_equal(found, apart.min(axis=1))
        else:
            assert (found == FARTHEST).all()


def test_far_distances_stay_in_a_byte(executor):
    scalars = np.zeros((2, 2, 8 * 200), np.uint8)
    scalars[0, 0, 0] = 255
    distances = MinMaxCells(scalars, BYTES, executor).distances(only(255))
    np.testing.assert_array_equal(distances, np.minimum(np.arange(200), FARTHEST))
