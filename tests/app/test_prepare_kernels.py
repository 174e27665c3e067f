import os
import subprocess
import sys
from pathlib import Path

import pytest

from app.engines import compilation
from app.engines.engines import REAL_BUILDERS
from app.engines.requests import ReferenceSettings
from model.kernel_cache import KernelGroup

ROOT = Path(__file__).parents[2]
CHEST = "resources/volumes/lidc_chest_256x256x133_uint8.nrrd"


@pytest.mark.slow
@pytest.mark.parametrize("lighting", ["direct", "path"])
def test_what_is_prepared_is_not_compiled_again(tmp_path, lighting):
    settings = ReferenceSettings(lighting, renderer="raycast")
    names = [group.name for group in REAL_BUILDERS.kernels(compilation._ball("uint8"), settings)]
    _run(tmp_path, "-m", "app.prepare_kernels", *names)
    compiled = _kernels(tmp_path)
    assert compiled
    # The window, with its answers, and a picture to save.
    picture = str(tmp_path / "picture.png")
    looks = f"--volume {CHEST} --lighting {lighting} --renderer raycast".split()
    _run(tmp_path, "main.py", "--screenshot", picture, "--size", "600x400", *looks)
    _run(tmp_path, "main.py", "render", "--size", "32", "--out", picture, *looks)
    assert _kernels(tmp_path) == compiled


@pytest.mark.parametrize(
    ("voxels", "kind"), [("uint8", "uint8"), ("float32", "float32"), ("float64", "float32")]
)
def test_kernels_are_those_of_the_voxels_that_are_drawn(voxels, kind):
    volume = compilation._ball(voxels)
    found = REAL_BUILDERS.kernels(volume, ReferenceSettings("soft"))
    assert found == (KernelGroup(kind, "soft", "images"), KernelGroup(kind, "soft", "questions"))


def _run(cache, *arguments):
    environment = os.environ | {"XDG_CACHE_HOME": str(cache)}
    command = [sys.executable, *arguments]
    subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, check=True)


def _kernels(cache):
    return {file.name for file in cache.rglob("*.nbc")}
