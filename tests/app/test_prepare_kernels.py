"""Compiling ahead: what it prepares is what a volume's pictures use."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from app import prepare_kernels
from app.engines import preparation

ROOT = Path(__file__).parents[2]
CHEST = "resources/volumes/lidc_chest_256x256x133_uint8.nrrd"
PREPARE = """
import sys
from app import prepare_kernels
if __name__ == "__main__":
    prepare_kernels.PREPARED = (("uint8", "direct"),)
    sys.exit(prepare_kernels.main())
"""
USE = """
from app.engines.preparation import prepare
prepare("uint8", "direct")
"""


@pytest.mark.slow
def test_what_is_prepared_is_not_compiled_again(tmp_path: Path) -> None:
    script = tmp_path / "prepare.py"
    script.write_text(PREPARE)
    first = _run(tmp_path, str(script))
    compiled = _kernels(tmp_path)
    assert "done in" in first
    assert compiled

    assert _run(tmp_path, str(script)) == ""
    _run(tmp_path, "-c", USE)
    picture = tmp_path / "picture.png"
    picture_of = f"render --size 32 --lighting direct --renderer raycast --volume {CHEST} --out"
    _run(tmp_path, "main.py", *picture_of.split(), str(picture))
    assert picture.exists()
    assert _kernels(tmp_path) == compiled


def test_what_cannot_be_measured_harms_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> float:
        raise RuntimeError("the denoiser broke")

    monkeypatch.setattr(preparation, "measure_path_light", fail)
    monkeypatch.setattr(preparation, "prepare", lambda _voxels, _light: None)
    monkeypatch.setattr(prepare_kernels, "ProcessPoolExecutor", lambda *_: ThreadPoolExecutor(1))
    monkeypatch.setattr(prepare_kernels, "stamp", lambda: tmp_path / "prepared")
    assert prepare_kernels.main() == 0
    assert "the denoiser broke" in capsys.readouterr().err
    assert float((tmp_path / "prepared").read_text()) == math.inf


def test_its_volume_is_seen() -> None:
    volume = preparation._ball("uint8")
    assert volume.voxels.dtype == np.uint8
    assert volume.scalar_range[0] == 0
    assert volume.scalar_range[1] > 90


def _run(cache: Path, *arguments: str) -> str:
    environment = os.environ | {"XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def _kernels(cache: Path) -> set[str]:
    return {file.name for file in cache.rglob("*.nbc")}
