from __future__ import annotations

from pathlib import Path

import pytest

from app.cli import run


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
