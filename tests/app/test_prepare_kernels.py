"""Compiling ahead: what it prepares is what a volume's pictures use."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.engines import preparation
from app.engines.engines import REAL_BUILDERS, ReferenceSettings
from model.kernel_cache import KernelGroup

ROOT = Path(__file__).parents[2]
CHEST = "resources/volumes/lidc_chest_256x256x133_uint8.nrrd"


@pytest.mark.slow
def test_what_is_prepared_is_not_compiled_again(tmp_path: Path) -> None:
    prepare = "from app.prepare_kernels import main\n"
    groups = ["uint8-direct-images", "uint8-direct-questions"]
    _run(tmp_path, prepare + f"main({groups})")
    compiled = _kernels(tmp_path)
    assert compiled
    picture = tmp_path / "picture.png"
    picture_of = f"render --size 32 --lighting direct --renderer raycast --volume {CHEST} --out"
    _run(
        tmp_path,
        "from app.cli import run\n"
        "from app.engines.preparation import prepare\n"
        "from model.kernel_cache import KernelGroup\n"
        f"for group in {groups}: prepare(KernelGroup.named(group))\n"
        f"assert run({[*picture_of.split(), str(picture)]}) == 0",
    )
    assert picture.exists()
    assert _kernels(tmp_path) == compiled


@pytest.mark.parametrize(
    ("voxels", "kind"),
    [("uint8", "uint8"), ("float32", "float32"), ("float64", "float32")],
)
def test_kernels_are_those_of_the_voxels_that_are_drawn(voxels: str, kind: str) -> None:
    volume = preparation._ball(voxels)
    found = REAL_BUILDERS.kernels(volume, ReferenceSettings("soft"))
    assert found == (KernelGroup(kind, "soft", "images"), KernelGroup(kind, "soft", "questions"))


def _run(cache: Path, script: str) -> None:
    environment = os.environ | {"XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(ROOT)}
    subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, env=environment, capture_output=True, check=True
    )


def _kernels(cache: Path) -> set[str]:
    return {file.name for file in cache.rglob("*.nbc")}
