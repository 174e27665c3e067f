import numpy as np
import pytest
from ramp import make_volume

from model.errors import DatasetError
from model.rendering.path_tracing.denoising import available
from model.samples import path_light_pairs
from model.samples.path_light_pairs import FEW, Pairs, read_pairs, write_block, write_pairs

needs_denoiser = pytest.mark.skipif(not available(), reason="no denoiser for this machine")


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setattr(path_light_pairs, "SIZE", 32)
    monkeypatch.setattr(path_light_pairs, "BLOCK", 2)


@needs_denoiser
def test_pairs_are_drawn_once_and_alike(tmp_path):
    volume = make_volume()
    (path,) = write_pairs(tmp_path / "a", [volume], 1, seed=3, many=16)
    assert not list(write_pairs(tmp_path / "a", [volume], 1, seed=3, many=16))
    list(write_pairs(tmp_path / "b", [volume], 1, seed=3, many=16))
    first, again = (read_pairs(tmp_path / name)[path.name.split("-")[0]] for name in "ab")
    for name, values in vars(first).items():
        np.testing.assert_array_equal(values, getattr(again, name))
    assert len(list(write_pairs(tmp_path / "a", [volume], 2, seed=3, many=16))) == 1


@pytest.mark.slow
@needs_denoiser
def test_more_samples_are_nearer_to_what_is_learned(tmp_path):
    list(write_pairs(tmp_path, [make_volume()], 2, many=64))
    (pairs,) = read_pairs(tmp_path).values()
    assert pairs.denoised.shape[1] == pairs.traced.shape[1] == len(FEW)

    def rmse(pictures):
        return float(np.sqrt(np.mean((pictures.astype(float) - pairs.exact) ** 2)))

    errors = [rmse(pairs.traced[:, place]) for place in range(len(FEW))]
    assert errors == sorted(errors, reverse=True)
    assert rmse(pairs.denoised[:, 0]) < errors[0]
    assert pairs.error.max() < errors[-1]


def test_damaged_and_missing_pairs_are_told(tmp_path):
    with pytest.raises(DatasetError, match="light pairs"):
        read_pairs(tmp_path)
    (tmp_path / "a-0-0000.npz").write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(DatasetError, match="damaged"):
        read_pairs(tmp_path)


def test_blocks_of_a_volume_are_joined(tmp_path):
    def pairs(value):
        color = np.full((2, 3, 4, 4), value, np.float16)
        few = np.full((2, len(FEW), 3, 4, 4), value, np.float16)
        return Pairs(color, color, color, color[:, :1], few, few, color, np.full(2, value))

    for number, name in enumerate(["a-0-0000", "a-0-0001", "b-0-0000"]):
        write_block(tmp_path / f"{name}.npz", pairs(float(number)))
    found = read_pairs(tmp_path)
    assert found["a"].error.tolist() == [0, 0, 1, 1]
    assert found["b"].exact.max() == 2
