from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import zarr

from model.errors import DatasetError
from model.samples.sample_rendering import make_renderer, render_store
from model.samples.sample_store import BLOCK, SampleBatch, SampleStore
from model.samples.sampling import Split, draw_sample
from model.scene.scene import Scene
from model.scene.view import View
from model.scene.volume import Volume


def content(store: SampleStore, split: Split) -> SampleBatch:
    return store.read(split, range(store.count(split)))


def assert_equal(one: SampleBatch, other: SampleBatch) -> None:
    assert one.arrays.keys() == other.arrays.keys()
    for name, values in one.arrays.items():
        np.testing.assert_array_equal(values, other.arrays[name])


def test_samples_are_what_the_sampler_and_the_renderer_say(
    store: SampleStore, scene: Scene, volume: Volume
) -> None:
    index = 77
    sample = draw_sample(scene, 7, "train", index)
    stored = store.read("train", range(index, index + 1))
    assert View(*stored.inputs["view"][0]) == sample.view
    opacity, color = sample.transfer_function.opacity, sample.transfer_function.color
    np.testing.assert_array_equal(stored.inputs["opacity_tf"][0], opacity.sample())
    np.testing.assert_array_equal(stored.inputs["color_tf"][0], color.sample())
    renderer = make_renderer(volume, scene)
    image = renderer.render(sample, scene.image_size)
    renderer.close()
    np.testing.assert_allclose(stored.rgba[0] / 255, image, atol=1e-6)


def test_two_processes_write_the_same_store(
    store: SampleStore, scene: Scene, volume: Volume, tmp_path: Path
) -> None:
    other = SampleStore.create(tmp_path / "two.zarr", scene, 7, {"train": 100, "holdout": 32})
    render_store(other, volume, workers=2)
    other.require_complete()
    assert_equal(content(other, "train"), content(store, "train")[:100])
    assert_equal(content(other, "holdout"), content(store, "holdout"))


def test_a_store_can_grow(store: SampleStore, scene: Scene, volume: Volume, tmp_path: Path) -> None:
    path = tmp_path / "grown.zarr"
    counts: dict[Split, int] = {"train": 40, "holdout": 5}
    render_store(SampleStore.create(path, scene, 7, counts), volume, workers=1)
    grown = SampleStore.create(path, scene, 7, {"train": 70, "holdout": 5})
    # The second block was not full: it is rendered again, the first one stays.
    assert grown.missing_samples() == 70 - BLOCK
    seen: list[int] = []
    render_store(grown, volume, workers=1, on_progress=seen.append)
    assert sum(seen) == 70 - BLOCK
    assert_equal(content(grown, "train"), content(store, "train")[:70])


KILLED = """
import sys
from itertools import islice
from pathlib import Path
from model.samples.sample_store import SampleStore
from model.samples.sample_rendering import render_store
sys.path.insert(0, "tests/model")
from conftest import blobs
if __name__ == "__main__":
    render_store(SampleStore(Path(sys.argv[1])), blobs(), 1, lambda n: print(n, flush=True))
"""


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_a_killed_rendering_goes_on_without_loss_or_repetition(
    store: SampleStore, scene: Scene, volume: Volume, tmp_path: Path
) -> None:
    path = tmp_path / "killed.zarr"
    SampleStore.create(path, scene, 7, {"train": 160, "holdout": 32})
    script = tmp_path / "render.py"
    script.write_text(KILLED)
    process = subprocess.Popen(
        [sys.executable, str(script), str(path)],
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(Path.cwd())},
        start_new_session=True,
        text=True,
    )
    assert process.stdout is not None
    for _ in range(2):
        assert process.stdout.readline().strip() == str(BLOCK)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()

    resumed = SampleStore(path)
    missing = resumed.missing_samples()
    assert 0 < missing <= 192 - 2 * BLOCK
    with pytest.raises(DatasetError, match=f"{missing} samples are not rendered yet"):
        resumed.require_complete()
    seen: list[int] = []
    render_store(resumed, volume, workers=1, on_progress=seen.append)
    assert sum(seen) == missing
    assert_equal(content(resumed, "train"), content(store, "train"))


def test_a_pass_shows_each_sample_once_in_random_order(store: SampleStore) -> None:
    batches = list(islice(store.shuffled("train", [0], 16), 10))
    assert [len(b) for b in batches] == [16] * 10
    azimuths = np.concatenate([b.inputs["view"][:, 0] for b in batches])
    expected = content(store, "train").inputs["view"][:, 0]
    assert not np.array_equal(azimuths, expected)
    np.testing.assert_array_equal(np.sort(azimuths), np.sort(expected))


@pytest.mark.parametrize("skip", [0, 1, 3, 6, 13])
def test_a_pass_can_start_in_the_middle(
    store: SampleStore, skip: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("model.samples.sample_store.POOL_BLOCKS", 2)
    whole = list(islice(store.shuffled("train", [5], 20), 20))
    rest = list(islice(store.shuffled("train", [5], 20, skip=skip), 20 - skip))
    for one, other in zip(whole[skip:], rest, strict=True):
        assert_equal(one, other)


def test_a_kill_while_growing_leaves_a_store_that_can_go_on(
    scene: Scene, volume: Volume, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    counts: dict[Split, int] = {"train": 40, "holdout": 5}
    for resizes in range(5):
        path = tmp_path / f"{resizes}.zarr"
        SampleStore.create(path, scene, 7, counts)
        with monkeypatch.context() as patch:
            left = iter(range(resizes))
            resize = zarr.Array.resize
            patch.setattr(
                zarr.Array,
                "resize",
                lambda self, shape, r=resize, n=left: (next(n), r(self, shape)),
            )
            with pytest.raises(StopIteration):
                SampleStore.create(path, scene, 7, {"train": 100})
        store = SampleStore.create(path, scene, 7, {"train": 100})
        assert (store.count("train"), store.missing_samples()) == (100, 105)


def test_an_unwritable_place_is_said(scene: Scene, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DatasetError, match=r"cannot be written|not a tfscope"):
        SampleStore.create(tmp_path / "file" / "s.zarr", scene, 7, {"train": 5})


def test_foreign_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no data set here"):
        SampleStore(tmp_path / "none")
    with pytest.raises(DatasetError, match="not a tfscope data set"):
        SampleStore(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DatasetError, match="not a tfscope data set"):
        SampleStore.create(tmp_path, Scene("v", "f", (0, 1), (0.2, 0.8), 64), 0, {"train": 1})
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_another_scene_or_volume_is_refused(
    store: SampleStore, volume: Volume, scene: Scene
) -> None:
    with pytest.raises(DatasetError, match="another volume, size, lighting or seed"):
        SampleStore.create(store.path, Scene.of(volume, 128), 7, {"train": 1})
    with pytest.raises(DatasetError, match="another volume, size, lighting or seed"):
        SampleStore.create(store.path, scene, 8, {"train": 1})
    other = Volume(volume.scalars[::-1], volume.spacing)
    with pytest.raises(DatasetError, match="is not the one"):
        make_renderer(other, scene)


def copied(store: SampleStore, to: Path) -> Path:
    return Path(shutil.copytree(store.path, to))


def chunk_files(path: Path, split: str = "train", name: str = "rgba") -> list[Path]:
    return sorted(file for file in (path / split / name / "c").rglob("*") if file.is_file())


def test_a_lost_chunk_is_found_and_rendered_again(
    store: SampleStore, volume: Volume, tmp_path: Path
) -> None:
    path = copied(store, tmp_path / "lost.zarr")
    chunk_files(path)[1].unlink()
    lost = SampleStore(path)
    assert lost.missing_blocks("train") == [range(BLOCK, 2 * BLOCK)]
    with pytest.raises(DatasetError, match="not rendered yet"):
        lost.require_complete()
    with pytest.raises(DatasetError, match=r"samples 32 to 63 are lost .*rgba"):
        lost.read("train", range(40, 41))
    assert lost.reopen_damaged() == BLOCK
    render_store(lost, volume, workers=1)
    assert_equal(content(lost, "train"), content(store, "train"))


def test_a_flipped_bit_is_found_and_rendered_again(
    store: SampleStore, volume: Volume, tmp_path: Path
) -> None:
    path = copied(store, tmp_path / "flipped.zarr")
    file = chunk_files(path, name="view")[0]
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 4
    file.write_bytes(data)
    flipped = SampleStore(path)
    assert flipped.missing_samples() == 0
    with pytest.raises(DatasetError, match="samples 0 to 31 are lost or altered"):
        flipped.read("train", range(BLOCK))
    assert flipped.reopen_damaged() == BLOCK
    render_store(flipped, volume, workers=1)
    assert_equal(content(flipped, "train"), content(store, "train"))


def test_black_samples_are_written(scene: Scene, tmp_path: Path) -> None:
    store = SampleStore.create(tmp_path / "black.zarr", scene, 7, {"train": BLOCK, "holdout": 0})
    shapes = {n: a.shape[1:] for n, a in store.read("train", range(0)).arrays.items()}
    zeros = {n: np.zeros((BLOCK, *shape), dtype=np.uint8) for n, shape in shapes.items()}
    store.write_block("train", range(BLOCK), SampleBatch.of(zeros))
    assert store.missing_samples() == 0
    assert not store.read("train", range(BLOCK)).rgba.any()


@pytest.mark.parametrize("what", ["shape", "type", "text", "huge"])
def test_a_damaged_description_is_one_sentence(
    store: SampleStore, tmp_path: Path, what: str
) -> None:
    path = copied(store, tmp_path / "described.zarr")
    file = path / "train" / "rgba" / "zarr.json"
    described = json.loads(file.read_text())
    if what == "shape":
        described["shape"][1] += 1
    elif what == "type":
        described["data_type"] = "float64"
    elif what == "huge":
        file = path / "train" / "view" / "zarr.json"
        described = json.loads(file.read_text())
        described["shape"][0] = 10**18
    file.write_text("{" if what == "text" else json.dumps(described))
    with pytest.raises(DatasetError):
        SampleStore(path)


def test_a_flag_that_cannot_be_read_is_a_block_to_render(
    store: SampleStore, tmp_path: Path
) -> None:
    path = copied(store, tmp_path / "flag.zarr")
    chunk_files(path, name="complete")[0].write_bytes(b"?")
    assert SampleStore(path).missing_blocks("train") == [range(BLOCK)]


def test_a_store_keeps_how_long_its_samples_took(store: SampleStore, tmp_path: Path) -> None:
    own = SampleStore.create(tmp_path / "own.zarr", store.scene, 0, {"train": 4, "holdout": 4})
    assert own.rendering == (0.0, 0)
    own.add_rendering(2.5, 3)
    own.add_rendering(1.5, 5)
    assert SampleStore(own.path).rendering == (4.0, 8)
    own._root.attrs["rendering"] = {"seconds": "long", "samples": None}
    assert SampleStore(own.path).rendering == (0.0, 0)
