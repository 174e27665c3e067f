"""The benchmark of compact volumes: rivals at as many bytes, errors that grow as bytes go."""

from __future__ import annotations

import numpy as np

from model.benchmarks.compact import compare_compressors
from model.scene.volume import Volume


def test_rivals_have_as_many_bytes_and_fewer_bytes_more_error() -> None:
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, 40)], indexing="ij")
    values = 100 * np.cos(9 * x * y + 5 * z) + np.random.default_rng(0).normal(0, 3, x.shape)
    volume = Volume(values.astype(np.float32))
    rows = list(compare_compressors(volume, [0.5, 0.125], 3, rivals=True))
    assert [row.name for row in rows] == 2 * ["compact volume", "ZFP", "SZ3"]
    for own, *rivals in (rows[:3], rows[3:]):
        for rival in rivals:
            assert 0.7 * own.bytes_a_voxel < rival.bytes_a_voxel <= own.bytes_a_voxel
    for few, many in zip(rows[3:], rows[:3], strict=True):
        assert few.rmse > many.rmse > 0
        assert few.largest >= few.rmse


def test_a_volume_that_fits_is_kept_without_loss() -> None:
    values = np.zeros((16, 16, 16), np.uint8)
    values[4:12] = 200
    (row,) = compare_compressors(Volume(values), [0.5], 2, rivals=False)
    assert (row.name, row.rmse, row.largest) == ("without loss", 0.0, 0.0)
