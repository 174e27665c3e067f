import json
import shutil
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from ramp import make_volume

from model.errors import DatasetError
from model.rendering.path_tracing.denoising import available
from model.samples import path_light_pairs
from model.samples.path_light_pairs import FEW, Pairs, read_pairs, write_block, write_pairs
from model.samples.sample_rendering import make_renderer, render_store
from model.samples.sample_store import BLOCK, SampleStore
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.view import View
from model.scene.volume import Volume


def content(store, split):
    return store.read(split, range(store.count(split))).arrays


def test_samples_are_what_the_sampler_and_the_renderer_say(store, scene, volume):
    index = 77
    sample = draw_sample(scene, 7, "train", index)
    stored = store.read("train", range(index, index + 1))
    assert View(*stored.inputs["view"][0]) == sample.view
    opacity, color = sample.transfer_function.opacity, sample.transfer_function.color
    np.testing.assert_array_equal(stored.inputs["opacity_tf"][0], opacity.sample())
    np.testing.assert_array_equal(stored.inputs["color_tf"][0], color.sample())
    image = make_renderer(volume, scene).render(sample, scene.image_size)
    np.testing.assert_allclose(stored.rgba[0] / 255, image, atol=1e-6)


def test_a_store_can_grow_and_two_processes_write_the_same(store, scene, volume, tmp_path):
    path = tmp_path / "grown.zarr"
    counts = {"train": 40, "holdout": 5}
    render_store(SampleStore.create(path, scene, 7, counts), volume, workers=1)
    grown = SampleStore.create(path, scene, 7, {"train": 100, "holdout": 5})
    # The second block was not full: it is rendered again, the first one stays.
    assert grown.missing_samples() == 100 - BLOCK
    seen = []
    render_store(grown, volume, workers=2, on_progress=seen.append)
    assert sum(seen) == 100 - BLOCK
    grown.require_complete()
    for split in ("train", "holdout"):
        expected = store.read(split, range(grown.count(split)))
        np.testing.assert_equal(content(grown, split), expected.arrays)


def test_a_pass_shows_each_sample_once_in_random_order(store):
    batches = list(islice(store.shuffled("train", [0], 16), 10))
    assert [len(b) for b in batches] == [16] * 10
    azimuths = np.concatenate([b.inputs["view"][:, 0] for b in batches])
    expected = content(store, "train")["view"][:, 0]
    assert not np.array_equal(azimuths, expected)
    np.testing.assert_array_equal(np.sort(azimuths), np.sort(expected))


@pytest.mark.parametrize("skip", [0, 1, 3, 6, 13])
def test_a_pass_can_start_in_the_middle(store, skip, monkeypatch):
    monkeypatch.setattr("model.samples.sample_store.POOL_BLOCKS", 2)
    whole = list(islice(store.shuffled("train", [5], 20), 20))
    rest = list(islice(store.shuffled("train", [5], 20, skip=skip), 20 - skip))
    for one, other in zip(whole[skip:], rest, strict=True):
        np.testing.assert_equal(one.arrays, other.arrays)


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
    other = Volume(volume.voxels[::-1], volume.spacing)
    with pytest.raises(DatasetError, match="is not the one"):
        make_renderer(other, scene)


def copied(store, to):
    return Path(shutil.copytree(store.path, to))


def chunk_files(path, split="train", name="rgba"):
    return sorted(file for file in (path / split / name / "c").rglob("*") if file.is_file())


def test_damaged_chunks_are_found_and_rendered_again(store, volume, tmp_path):
    path = copied(store, tmp_path / "damaged.zarr")
    chunk_files(path)[1].unlink()
    flipped = chunk_files(path, name="view")[0]
    data = bytearray(flipped.read_bytes())
    data[len(data) // 2] ^= 4
    flipped.write_bytes(data)
    damaged = SampleStore(path)
    # Other damage than a lack is found where it is read.
    assert damaged.missing_samples() == BLOCK
    for samples in (range(BLOCK), range(BLOCK, 2 * BLOCK)):
        with pytest.raises(DatasetError, match=f"samples {samples[0]} to {samples[-1]} are lost"):
            damaged.read("train", samples)
    assert damaged.reopen_damaged() == 2 * BLOCK
    render_store(damaged, volume, workers=1)
    np.testing.assert_equal(content(damaged, "train"), content(store, "train"))


@pytest.mark.parametrize(("name", "change"), [
    ("rgba", {"shape": [160, 65, 64, 4]}), ("rgba", {"data_type": "float64"}), ("rgba", None),
    ("view", {"shape": [10**18, 4]}),
])  # fmt: skip
def test_a_damaged_description_is_one_sentence(store, tmp_path, name, change):
    path = copied(store, tmp_path / "described.zarr")
    file = path / "train" / name / "zarr.json"
    described = json.loads(file.read_text())
    file.write_text(json.dumps(described | change) if change else "{")
    with pytest.raises(DatasetError):
        SampleStore(path)


def test_a_flag_that_cannot_be_read_is_a_block_to_render(store, tmp_path):
    path = copied(store, tmp_path / "flag.zarr")
    chunk_files(path, name="complete")[0].write_bytes(b"?")
    assert SampleStore(path).missing_blocks("train") == [range(BLOCK)]


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
    np.testing.assert_equal(vars(first), vars(again))
    assert len(list(write_pairs(tmp_path / "a", [volume], 2, seed=3, many=16))) == 1


def test_damaged_and_missing_pairs_are_reported(tmp_path):
    with pytest.raises(DatasetError, match="light pairs"):
        read_pairs(tmp_path)
    (tmp_path / "a-0-0000.npz").write_bytes(b"PK\x03\x04 no archive")
    with pytest.raises(DatasetError, match="damaged"):
        read_pairs(tmp_path)


def test_blocks_of_a_volume_are_joined(tmp_path):
    def pairs(value):
        color = np.full((2, 3, 4, 4), value, np.float16)
        few = np.full((2, len(FEW), 3, 4, 4), value, np.float16)
        return Pairs(color, color, color[:, :1], few, few, color, np.full(2, value))

    for number, name in enumerate(["a-0-0000", "a-0-0001", "b-0-0000"]):
        write_block(tmp_path / f"{name}.npz", pairs(float(number)))
    found = read_pairs(tmp_path)
    assert found["a"].error.tolist() == [0, 0, 1, 1]
    assert found["b"].exact.max() == 2
