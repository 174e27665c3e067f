from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from model.networks.refined.coarse_volume import (
    MEAN_STEPS,
    SPREAD_STEPS,
    CoarseVolume,
    coarse_shape,
)
from model.scene.volume import Volume


def enlarged(coarse: CoarseVolume, volume: Volume) -> np.ndarray:
    """Means interpolated at the voxels, in parts of the scalar range."""
    steps = [
        np.linspace(0, m - 1, n)
        for m, n in zip(coarse.means.shape, volume.scalars.shape, strict=True)
    ]
    places = np.meshgrid(*steps, indexing="ij")
    return map_coordinates(coarse.means / MEAN_STEPS, places, order=1, mode="nearest")


def test_a_small_volume_is_kept_as_it_is(volume: Volume) -> None:
    coarse = CoarseVolume.of(volume, most=5_200)
    assert coarse.dimensions == volume.dimensions
    np.testing.assert_array_equal(coarse.means, volume.scalars)
    assert not coarse.spreads.any()


def test_a_straight_field_has_no_spread_however_steep() -> None:
    z, y, x = np.mgrid[0:30, 0:40, 0:20].astype(np.float32)
    volume = Volume(2 * x + 3 * y - z, (1.0, 1.0, 2.0))
    coarse = CoarseVolume.of(volume, most=3000)
    assert coarse.means.size <= 3000
    lo, hi = volume.scalar_range
    miss = enlarged(coarse, volume) - (volume.scalars - lo) / (hi - lo)
    inner = (slice(4, -4),) * 3
    assert abs(miss[inner]).max() < 1.5 / MEAN_STEPS
    assert coarse.spreads[2:-2, 2:-2, 2:-2].max() <= 1


def test_noise_has_the_spread_of_the_noise() -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(0.5, 0.05, (48, 48, 48)).astype(np.float32)
    noise.flat[:2] = 0.0, 1.0
    coarse = CoarseVolume.of(Volume(noise), most=14**3)
    assert coarse.dimensions == (14, 14, 14)
    inner = (slice(2, -2),) * 3
    found = np.sqrt(np.mean((coarse.spreads[inner].astype(float) ** 2 / SPREAD_STEPS) ** 2))
    # The means follow the noise a little, so that slightly less of it is missed.
    assert found == pytest.approx(0.05, rel=0.08)
    assert coarse.means[inner].mean() / MEAN_STEPS == pytest.approx(0.5, abs=0.003)


def test_the_spread_is_what_the_means_miss(volume: Volume) -> None:
    coarse = CoarseVolume.of(volume, most=1000)
    lo, hi = volume.scalar_range
    miss = enlarged(coarse, volume) - (volume.scalars - lo) / (hi - lo)
    whole = np.sqrt(np.mean((coarse.spreads.astype(float) ** 2 / SPREAD_STEPS) ** 2))
    assert whole == pytest.approx(np.sqrt(np.mean(miss**2)), rel=0.2)


def test_the_grid_lies_over_the_same_box(volume: Volume) -> None:
    coarse = CoarseVolume.of(volume, most=700)
    np.testing.assert_allclose(coarse.extent, volume.proportions)
    assert coarse.radius == pytest.approx(0.5)
    assert coarse.voxel_size == pytest.approx(volume.voxel_size / (2 * volume.radius))
    assert max(coarse.spacing) < 1.8 * min(coarse.spacing)


@pytest.mark.parametrize("dimensions", [(1024, 1024, 1024), (2, 3, 4_000_000), (300, 7, 900)])
def test_the_number_of_nodes_is_kept(dimensions: tuple[int, int, int]) -> None:
    shape = coarse_shape(dimensions, 1_000_000)
    assert 0.7e6 < np.prod(shape) <= 1_000_000
    assert all(2 <= m <= n for m, n in zip(shape, dimensions, strict=True))


@pytest.mark.parametrize("span", [1e-300, 1e300])
def test_extreme_ranges(span: float) -> None:
    values = np.linspace(-span, span, 4 * 5 * 30).reshape(4, 5, 30)
    coarse = CoarseVolume.of(Volume(values), most=200)
    assert coarse.means.min() < 30
    assert coarse.means.max() > 225
