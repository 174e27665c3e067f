import os

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import pytest
from blobs import blobs
from lively import SIZE, lively_network

from model.generator.generator import Generator
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sample_store import SPLITS, SampleStore
from model.scene.scene import Scene


@pytest.fixture(scope="session")
def volume():
    return blobs()


@pytest.fixture(scope="session")
def scene(volume):
    return Scene.of(volume, image_size=64)


@pytest.fixture(scope="session")
def store(volume, scene, tmp_path_factory):
    """A complete store of 160 training and 32 hold-out samples."""
    path = tmp_path_factory.mktemp("stores") / "blobs.zarr"
    store = SampleStore.create(path, scene, 7, {"train": 160, "holdout": 32})
    # Here: a process of its own would import all libraries once more.
    renderer = make_renderer(volume, scene)
    for split in SPLITS:
        for block in store.missing_blocks(split):
            store.write_block(split, block, render_samples(renderer, scene, 7, split, block))
    return store


@pytest.fixture(scope="session")
def lively_folder(scene, tmp_path_factory):
    """An untrained model whose images depend on all that goes in."""
    folder = tmp_path_factory.mktemp("models") / "lively"
    save_model(folder, ModelCard(scene, "draft", SIZE), lively_network())
    return folder


@pytest.fixture(scope="session")
def lively_generator(lively_folder):
    return Generator.load(lively_folder, "cpu")
