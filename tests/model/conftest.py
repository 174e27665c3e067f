from __future__ import annotations

import os
from pathlib import Path

os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import numpy as np
import pytest

from model.samples.sample_rendering import render_store
from model.samples.sample_store import SampleStore
from model.scene.scene import Scene
from model.scene.volume import Volume


def blobs() -> Volume:
    """A small anisotropic volume without symmetries: three Gaussian blobs."""
    z, y, x = np.mgrid[0:20, 0:24, 0:16].astype(np.float64)
    field = np.zeros_like(x)
    for cx, cy, cz, size, height in ((5, 8, 6, 4, 1.0), (11, 17, 13, 3, 0.7), (6, 18, 15, 2, 0.9)):
        square = (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2
        field += height * np.exp(-square / size**2)
    return Volume(
        np.rint(255 * field / field.max()).astype(np.uint8), (1.5, 1.0, 1.2), name="blobs"
    )


@pytest.fixture(scope="session")
def volume() -> Volume:
    return blobs()


@pytest.fixture(scope="session")
def scene(volume: Volume) -> Scene:
    return Scene.of(volume, image_size=64)


@pytest.fixture(scope="session")
def store(volume: Volume, scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> SampleStore:
    """A complete store of 160 training and 32 hold-out samples."""
    path: Path = tmp_path_factory.mktemp("stores") / "blobs.zarr"
    store = SampleStore.create(path, scene, 7, {"train": 160, "holdout": 32})
    render_store(store, volume, workers=1)
    return store
