"""Saving compact volumes: the error that is told is the error that images have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from model.errors import VolumeError
from model.evaluation.compact_error import TrueImages, restored
from model.evaluation.compact_saving import CompactOrder, save_compact
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.volume_files import read_volume
from model.volume_files.voxel_code import encode_voxels


@pytest.fixture(scope="module")
def noisy() -> Volume:
    """A ball with noise, of which little is left in few bytes."""
    z, y, x = np.meshgrid(*3 * [np.linspace(-1, 1, 32)], indexing="ij")
    ball = 200 * np.exp(-3 * (x**2 + y**2 + z**2))
    noise = np.random.default_rng(0).normal(0, 8, ball.shape)
    return Volume(np.clip(np.rint(ball + noise), 0, 255).astype(np.uint8))


def test_the_error_is_that_of_the_images(noisy: Volume) -> None:
    copy = restored(noisy, encode_voxels(noisy.voxels, noisy.voxels.size // 10))
    found = TrueImages(noisy).error_of(copy, 5)
    scene = Scene.of(noisy, 128, renderer="raycast")
    expected = []
    for index in range(5):
        inputs = draw_sample(scene, 7, "holdout", index)
        one, other = (
            RaycastRenderer(v, "none", None, 0.5).render(inputs, 128).astype(np.float64)
            for v in (noisy, copy)
        )
        expected.append(np.sqrt(((one - other)[..., :3] ** 2).mean()))
    assert found.rmse == pytest.approx(np.mean(expected), rel=1e-4)
    assert found.largest == pytest.approx(max(expected), rel=1e-4)
    assert found.rmse > 1e-3


def test_a_size_is_kept_and_measured(noisy: Volume, tmp_path: Path) -> None:
    path, told = tmp_path / "a.tfvolume", []
    order = CompactOrder(path, megabytes=0.004, images=4)
    result = save_compact(noisy, order, lambda what, done: told.append((what, done)))
    assert result.nbytes == path.stat().st_size < 0.004e6 + 3000
    copy = read_volume(path)
    assert result.error == TrueImages(noisy).error_of(copy, 4)
    assert result.sentence.endswith("over 4 random views and TFs.")
    assert told[-1] == ("measuring the error", 1.0)


@pytest.mark.slow
def test_an_error_is_kept_with_no_more_bytes_than_it_takes(noisy: Volume, tmp_path: Path) -> None:
    sizes = []
    for number, most in enumerate((0.02, 0.01, 0.003)):
        path = tmp_path / f"{number}.tfvolume"
        result = save_compact(noisy, CompactOrder(path, error=most, images=24))
        sizes.append(result.nbytes)
        assert result.error is None or result.error.rmse <= most
    assert sizes == sorted(sizes) and sizes[0] < sizes[-1]


def test_who_cancels_leaves_no_file(noisy: Volume, tmp_path: Path) -> None:
    def stop(what: str, done: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        save_compact(noisy, CompactOrder(tmp_path / "a.tfvolume", error=0.01), stop)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("size", "error"), [(None, None), (1.0, 0.1), (0.0, None), (float("nan"), None)]
)
def test_orders_that_make_no_sense_are_refused(size: float | None, error: float | None) -> None:
    with pytest.raises(VolumeError, match=r"megabytes|MB"):
        CompactOrder(Path("a.tfvolume"), size, error)


def test_a_place_that_cannot_be_written_is_told(noisy: Volume, tmp_path: Path) -> None:
    path = tmp_path / "missing" / "a.tfvolume"
    with pytest.raises(VolumeError, match="cannot be written"):
        save_compact(noisy, CompactOrder(path, megabytes=1.0))
