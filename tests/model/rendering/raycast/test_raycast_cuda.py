"""The ray caster for GPUs against the CPU's: in Numba's simulator, and on a GPU if there is one."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import device_images
import numpy as np
import pytest
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.raycast import cuda
from model.rendering.raycast.renderer import RaycastRenderer

ROOT = Path(__file__).resolve().parents[4]
SIZE = 8

Images = dict[str, NDArray[np.float32]]


def assert_same(found: Images, expected: Images) -> None:
    assert found.keys() == expected.keys()
    for name in expected:
        assert found[name].dtype == np.float32
        np.testing.assert_allclose(found[name], expected[name], atol=2e-3, err_msg=name)
    assert expected["none"][..., 3].max() > 0.9
    assert np.isinf(expected["depth"]).any() and np.isfinite(expected["depth"]).any()
    assert np.abs(expected["direct"] - expected["none"]).max() > 0.1
    for lighting in ("soft", "shadows"):
        assert np.abs(expected[lighting] - expected["none"]).max() > 0.1


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Images:
    """Images that the CUDA kernel draws, run as plain Python, thread by thread."""
    path = tmp_path_factory.mktemp("cuda") / "images.npz"
    environment = {
        **os.environ,
        "NUMBA_ENABLE_CUDASIM": "1",
        "NUMBA_DISABLE_JIT": "1",
        "PYTHONPATH": str(ROOT),
    }
    program = [sys.executable, device_images.__file__, str(path), str(SIZE)]
    done = subprocess.run(program, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with np.load(path) as images:
        return dict(images)


def test_the_simulated_gpu_draws_what_the_cpu_draws(simulated: Images) -> None:
    assert_same(simulated, device_images.images("cpu", SIZE))


@pytest.mark.skipif(not cuda.is_available(), reason="there is no GPU that Numba can use")
def test_the_gpu_draws_what_the_cpu_draws() -> None:
    assert_same(device_images.images("cuda", 64), device_images.images("cpu", 64))


@pytest.mark.skipif(cuda.is_available(), reason="there is a GPU")
def test_without_a_gpu_the_error_says_what_to_do() -> None:
    with pytest.raises(RenderError, match=r"no CUDA GPU.*CPU"):
        RaycastRenderer(device_images.volume(), device="cuda")


def test_pre_integration_is_refused_on_a_gpu() -> None:
    with pytest.raises(RenderError, match="unlit scenes on the CPU only"):
        RaycastRenderer(device_images.volume(), device="cuda", preintegrated=True)


def test_what_a_kernel_is_called_with_is_what_it_takes() -> None:
    # Numba refuses None as an argument of a kernel; the ray caster passes a null pointer.
    (extension,) = cuda._draw_pixels.extensions
    kind, value = extension.prepare_args("none", None, stream=0, retr=[])
    assert (str(kind), value) == ("int64", 0)
    assert extension.prepare_args("float64", 0.5, stream=0, retr=[]) == ("float64", 0.5)
