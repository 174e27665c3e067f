from __future__ import annotations

import numpy as np
import pytest
from toy_codec import ToyCodec

from model.errors import LatentError
from model.latent.codec_folder import load_codec
from model.latent.codes import TFCodec
from model.latent.path import path_codes


def test_a_path_passes_all_stations_with_even_steps() -> None:
    stations = np.array([[-0.5, 0.8], [0.4, 0.8], [0.4, -0.5]])
    codes = path_codes(ToyCodec(), stations, 101)
    assert codes[0] == pytest.approx(stations[0])
    assert codes[-1] == pytest.approx(stations[-1])
    corner = np.linalg.norm(codes - stations[1], axis=1).min()
    assert corner < 0.02
    steps = np.linalg.norm(np.diff(ToyCodec().decode(codes), axis=0), axis=1)
    # The corner's step is shorter; a straight leg's are equal but for where they are measured.
    assert steps.max() < 1.3 * np.median(steps)


def test_tfs_along_a_path_of_the_shipped_codec_are_continuous() -> None:
    """Steps of half the size when there are twice as many: no jump stays as large."""
    codec = TFCodec(load_codec()[1])
    stations = np.random.default_rng(3).uniform(-0.95, 0.95, (5, 8)).astype(np.float32)

    def largest_step(frames: int) -> float:
        tfs = codec.decode(path_codes(codec, stations, frames))
        return float(np.abs(np.diff(tfs, axis=0)).max())

    coarse, fine = largest_step(200), largest_step(1600)
    assert fine < coarse / 4


def test_stations_that_are_equal_do_not_divide_by_zero() -> None:
    codes = path_codes(ToyCodec(), np.zeros((2, 2)), 7)
    assert codes.shape == (7, 2)
    assert np.isfinite(codes).all()


def test_a_path_needs_two_places() -> None:
    with pytest.raises(LatentError, match="two places"):
        path_codes(ToyCodec(), np.zeros((1, 2)), 10)
