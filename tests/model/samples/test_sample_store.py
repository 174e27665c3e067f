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
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.view import View
from model.scene.volume import Volume


def content(store, split):
    return store.read(split, range(store.count(split)))


def assert_equal(one, other):
    assert one.arrays.keys() == other.arrays.keys()
    for name, values in one.arrays.items():
        np.testing.assert_array_equal(values, other.arrays[name])


def test_samples_are_what_the_sampler_and_the_renderer_say(store, scene, volume):
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


def test_two_processes_write_the_same_store(store, scene, volume, tmp_path):
    other = SampleStore.create(tmp_path / "two.zarr", scene, 7, {"train": 100, "holdout": 32})
    render_store(other, volume, workers=2)
    other.require_complete()
    assert_equal(content(other, "train"), content(store, "train")[:100])
    assert_equal(content(other, "holdout"), content(store, "holdout"))


def test_a_store_can_grow(store, scene, volume, tmp_path):
    path = tmp_path / "grown.zarr"
    counts = {"train": 40, "holdout": 5}
    render_store(SampleStore.create(path, scene, 7, counts), volume, workers=1)
    grown = SampleStore.create(path, scene, 7, {"train": 70, "holdout": 5})
    # The second block was not full: it is rendered again, the first one stays.
    assert grown.missing_samples() == 70 - BLOCK
    seen = []
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
from blobs import blobs
if __name__ == "__main__":
    render_store(SampleStore(Path(sys.argv[1])), blobs(), 1, lambda n: print(n, flush=True))
"""


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_a_killed_rendering_goes_on_without_loss_or_repetition(store, scene, volume, tmp_path):
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
    seen = []
    render_store(resumed, volume, workers=1, on_progress=seen.append)
    assert sum(seen) == missing
    assert_equal(content(resumed, "train"), content(store, "train"))


def test_a_pass_shows_each_sample_once_in_random_order(store):
    batches = list(islice(store.shuffled("train", [0], 16), 10))
    assert [len(b) for b in batches] == [16] * 10
    azimuths = np.concatenate([b.inputs["view"][:, 0] for b in batches])
    expected = content(store, "train").inputs["view"][:, 0]
    assert not np.array_equal(azimuths, expected)
    np.testing.assert_array_equal(np.sort(azimuths), np.sort(expected))


@pytest.mark.parametrize("skip", [0, 1, 3, 6, 13])
def test_a_pass_can_start_in_the_middle(store, skip, monkeypatch):
    monkeypatch.setattr("model.samples.sample_store.POOL_BLOCKS", 2)
    whole = list(islice(store.shuffled("train", [5], 20), 20))
    rest = list(islice(store.shuffled("train", [5], 20, skip=skip), 20 - skip))
    for one, other in zip(whole[skip:], rest, strict=True):
        assert_equal(one, other)


def test_a_kill_while_growing_leaves_a_store_that_can_go_on(scene, volume, tmp_path, monkeypatch):
    counts = {"train": 40, "holdout": 5}
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


def test_foreign_folders_and_unwritable_places_are_refused(scene, tmp_path):
    with pytest.raises(DatasetError, match="no data set here"):
        SampleStore(tmp_path / "none")
    with pytest.raises(DatasetError, match="not a tfscope data set"):
        SampleStore(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(DatasetError, match="not a tfscope data set"):
        SampleStore.create(tmp_path, scene, 0, {"train": 1})
    assert (tmp_path / "notes.txt").read_text() == "mine"
    with pytest.raises(DatasetError, match=r"cannot be written|not a tfscope"):
        SampleStore.create(tmp_path / "notes.txt" / "s.zarr", scene, 7, {"train": 5})


def test_another_scene_or_volume_is_refused(store, volume, scene):
    with pytest.raises(DatasetError, match="another volume, size, lighting or seed"):
        SampleStore.create(store.path, Scene.of(volume, 128), 7, {"train": 1})
    with pytest.raises(DatasetError, match="another volume, size, lighting or seed"):
        SampleStore.create(store.path, scene, 8, {"train": 1})
    other = Volume(volume.scalars[::-1], volume.spacing)
    with pytest.raises(DatasetError, match="is not the one"):
        make_renderer(other, scene)


def copied(store, to):
    return Path(shutil.copytree(store.path, to))


def chunk_files(path, split="train", name="rgba"):
    return sorted(file for file in (path / split / name / "c").rglob("*") if file.is_file())


def flip_a_bit(file):
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 4
    file.write_bytes(data)


@pytest.mark.parametrize(
    ("name", "block", "damage", "missing"),
    [("rgba", 1, Path.unlink, BLOCK), ("view", 0, flip_a_bit, 0)],
)
def test_a_damaged_chunk_is_found_and_rendered_again(
    store, volume, tmp_path, name, block, damage, missing
):
    path = copied(store, tmp_path / "damaged.zarr")
    damage(chunk_files(path, name=name)[block])
    damaged, samples = SampleStore(path), range(block * BLOCK, (block + 1) * BLOCK)
    assert damaged.missing_samples() == missing
    with pytest.raises(DatasetError, match=f"samples {samples[0]} to {samples[-1]} are lost"):
        damaged.read("train", samples)
    assert damaged.reopen_damaged() == BLOCK
    render_store(damaged, volume, workers=1)
    assert_equal(content(damaged, "train"), content(store, "train"))


def test_black_samples_are_written(scene, tmp_path):
    store = SampleStore.create(tmp_path / "black.zarr", scene, 7, {"train": BLOCK, "holdout": 0})
    shapes = {n: a.shape[1:] for n, a in store.read("train", range(0)).arrays.items()}
    zeros = {n: np.zeros((BLOCK, *shape), dtype=np.uint8) for n, shape in shapes.items()}
    store.write_block("train", range(BLOCK), SampleBatch.of(zeros))
    assert store.missing_samples() == 0
    assert not store.read("train", range(BLOCK)).rgba.any()


@pytest.mark.parametrize("what", ["shape", "type", "text", "huge"])
def test_a_damaged_description_is_one_sentence(store, tmp_path, what):
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


def test_a_flag_that_cannot_be_read_is_a_block_to_render(store, tmp_path):
    path = copied(store, tmp_path / "flag.zarr")
    chunk_files(path, name="complete")[0].write_bytes(b"?")
    assert SampleStore(path).missing_blocks("train") == [range(BLOCK)]


def test_a_store_keeps_how_long_its_samples_took(store, tmp_path):
    own = SampleStore.create(tmp_path / "own.zarr", store.scene, 0, {"train": 4, "holdout": 4})
    assert own.rendering == (0.0, 0)
    own.add_rendering(2.5, 3)
    own.add_rendering(1.5, 5)
    assert SampleStore(own.path).rendering == (4.0, 8)
    own._root.attrs["rendering"] = {"seconds": "long", "samples": None}
    assert SampleStore(own.path).rendering == (0.0, 0)
