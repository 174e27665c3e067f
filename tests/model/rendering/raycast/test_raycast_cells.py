"""Min-max cells against a search of the whole volume."""

from concurrent.futures import ThreadPoolExecutor
from itertools import product

import numpy as np
import pytest

from model.rendering.raycast.cells import FARTHEST, MinMaxCells

EDGE = 8
BYTES = (0.0, 1.0)
"""Lowest value and bins per unit of a volume of bytes from 0 to 255."""

SHAPES = [(2, 2, 2), (9, 9, 9), (10, 9, 8), (17, 25, 33), (40, 2, 19)]


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


@pytest.mark.parametrize("shape", SHAPES)
def test_a_cell_is_occupied_where_a_bin_in_its_range_shows(shape, executor):
    scalars = random_bytes(shape)
    cells = MinMaxCells(scalars, BYTES, executor)
    low, high = extremes(scalars)
    assert cells.shape == low.shape[::-1]
    for value in range(256):
        occupied = cells.distances(only(value)).reshape(low.shape) == 0
        # One bin of tolerance on either side, for rounding; no more.
        np.testing.assert_array_equal(occupied, (low - 1 <= value) & (value <= high + 1))


def test_values_beyond_the_range_count_for_its_ends(executor):
    scalars = (1000.0 * random_bytes((25, 12, 9)).astype(float) / 255 - 400).astype(np.float32)
    scalars[:9] = scalars[:9].clip(-400, -150)
    scalars[16:] = scalars[16:].clip(300, 600)
    # TFs lie from -100 to 155, one bin for each whole number.
    cells = MinMaxCells(scalars, (-100.0, 1.0), executor)
    low, high = extremes(scalars)
    low, high = (np.clip(np.rint(ends) + 100, 0, 255) for ends in (low, high))
    assert (high[0] == 0).all() and (low[-1] == 255).all()
    for value in (0, 17, 128, 255):
        occupied = cells.distances(only(value)).reshape(low.shape) == 0
        assert occupied[(low <= value) & (value <= high)].all()
        assert not occupied[(low - 2 >= value) | (value >= high + 2)].any()


@pytest.mark.parametrize("shape", SHAPES)
def test_distances_count_cells_diagonals_too(shape, executor):
    scalars = random_bytes(shape, 1)
    cells = MinMaxCells(scalars, BYTES, executor)
    low, high = extremes(scalars)
    places = np.array(list(np.ndindex(low.shape)))
    for first in (1, 60, 130, 200, 250):
        shown = np.arange(256) >= first
        occupied = places[(high + 1 >= first).ravel()]
        found = cells.distances(shown)
        assert found.dtype == np.int8
        if len(occupied) == 0:
            assert (found == FARTHEST).all()
            continue
        between = np.abs(places[:, None] - occupied).max(axis=-1).min(axis=1)
        np.testing.assert_array_equal(found, between)


def test_far_distances_stay_in_a_byte(executor):
    scalars = np.zeros((2, 2, 8 * 200), np.uint8)
    scalars[0, 0, 0] = 255
    distances = MinMaxCells(scalars, BYTES, executor).distances(only(255))
    np.testing.assert_array_equal(distances, np.minimum(np.arange(200), FARTHEST))
