"""Training of a scene whose light the kernels lack: the codec, then the refiner."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from model.networks.checkpoint import load_model
from model.networks.encoding import EncodedInputs, decode_unit
from model.networks.refined.refined_generator import RefinedGenerator
from model.networks.size import NetworkSize
from model.samples.sample_store import SampleBatch, SampleStore
from model.samples.sampling import draw_sample
from model.scene.inputs import store_inputs
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.training.options import Budget, StageOptions, TrainingOptions
from model.training.plan import TrainingPlan
from model.training.sources import StoredSource
from model.training.trainer import train

SIZE = NetworkSize(0.125, 32, 32, architecture="refined")
SCATTER = (0.9, 0.7, 0.5)
"""Factors of the coarse lit image's colour channels under the made-up light."""


@pytest.fixture
def scene(volume: Volume) -> Scene:
    return Scene.of(volume, 32, "global", renderer="vtk")


@pytest.fixture
def store(volume: Volume, scene: Scene, tmp_path: Path) -> SampleStore:
    """Samples in another light than the kernels', at once instead of after VTK's minutes."""
    store = SampleStore.create(tmp_path / "s.zarr", scene, 3, {"train": 64, "holdout": 32})
    network = untrained(volume, scene)
    for split in ("train", "holdout"):
        for block in store.missing_blocks(split):
            inputs = [draw_sample(scene, 3, split, index) for index in block]
            (images,) = network.features(EncodedInputs.of(inputs, scene))
            rgba = images[:, 4:].permute(0, 2, 3, 1).numpy() * np.array([*SCATTER, 1])
            batch = SampleBatch(
                store_inputs(inputs, scene), np.rint(255 * rgba.clip(0, 1)).astype(np.uint8)
            )
            store.write_block(split, block, batch)
    return store


def untrained(volume: Volume, scene: Scene) -> RefinedGenerator:
    from model.networks.build import build_generator

    network = build_generator(SIZE, scene, volume)
    assert isinstance(network, RefinedGenerator)
    return network.eval().requires_grad_(False)


def error(network: RefinedGenerator, scene: Scene, store: SampleStore) -> float:
    samples = store.read("holdout", range(32))
    with torch.no_grad():
        image, _ = network(EncodedInputs.stored(samples.inputs, scene))
    truth = torch.from_numpy(samples.rgba[..., :3] / 255).permute(0, 3, 1, 2)
    return float((decode_unit(image) - truth).square().mean().sqrt())


@pytest.mark.slow
def test_the_refiner_learns_another_light(
    volume: Volume, scene: Scene, store: SampleStore, tmp_path: Path
) -> None:
    plan = TrainingPlan(
        source=StoredSource(store),
        preset="draft",
        size=SIZE,
        options=replace(TrainingOptions(), refiner=StageOptions(8, 3e-3, 2.0), average_decay=0.9),
        budget=Budget(samples=960),
        folder=tmp_path / "run",
        device=torch.device("cpu"),
        volume=volume,
    )
    train(plan)
    with (tmp_path / "run" / "log.csv").open() as file:
        stages = list(dict.fromkeys(row["stage"] for row in csv.DictReader(file)))
    assert stages == ["codec", "refiner"]
    card, network = load_model(tmp_path / "run")
    assert isinstance(network, RefinedGenerator)
    assert card.scene.tf_family == "drawn"
    before = error(untrained(volume, scene), scene, store)
    assert error(network, scene, store) < 0.6 * before
