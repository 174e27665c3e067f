from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.cli import run
from model.samples.sample_store import SPLITS, SampleStore


@pytest.mark.slow
def test_a_local_cluster_makes_the_same_data_set(tmp_path: Path) -> None:
    raw = tmp_path / "ramp_6x5x4_uint8.raw"
    raw.write_bytes(np.arange(120, dtype=np.uint8).tobytes())
    arguments = f"dataset --volume {raw} --count 40 --size 16 --seed 3 --workers 1".split()
    stores = []
    for name, more in (("own", []), ("cluster", ["--scheduler", "local"])):
        assert run([*arguments, "--out", str(tmp_path / name), *more]) == 0
        stores.append(SampleStore(tmp_path / name))
        stores[-1].require_complete()
    own, cluster = stores
    for split in SPLITS:
        one, other = (s.read(split, range(own.count(split))) for s in (own, cluster))
        for name, values in one.arrays.items():
            np.testing.assert_array_equal(values, other.arrays[name])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--scheduler nowhere", "No Dask scheduler answers at 'nowhere'"),
        ("--scheduler tcp://host:8786 --workers 2", "leave one of --workers and --scheduler out"),
    ],
)
def test_bad_schedulers_get_one_line(
    arguments: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = f"dataset --count 5 --size 16 --out {tmp_path / 'store'} {arguments}"
    assert run(command.split()) == 2
    [line] = capsys.readouterr().err.splitlines()
    assert message in line
