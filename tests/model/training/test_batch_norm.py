from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from lively import SIZE, lively_network
from torch import nn
from training_runs import RECIPE, plan

from model.networks.checkpoint import load_model
from model.networks.generator_network import GeneratorNetwork
from model.samples.sample_store import SampleStore
from model.scene.scene import Scene
from model.training.batch import encode_batch
from model.training.batch_norm import SAMPLES, BatchNormRecalibration
from model.training.options import Budget
from model.training.schedule import Schedule
from model.training.sources import StoredSource
from model.training.state import load_stage
from model.training.trainer import train

CPU = torch.device("cpu")


def statistics_of(network: nn.Module) -> dict[str, torch.Tensor]:
    return {k: v for k, v in network.state_dict().items() if "running" in k}


@pytest.fixture
def generator() -> GeneratorNetwork:
    return lively_network().eval()


def test_layers_put_out_mean_0_and_variance_1(
    generator: GeneratorNetwork, store: SampleStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    # In one batch: of several, each would be drawn with its own mean.
    monkeypatch.setattr("model.training.batch_norm.BATCH", SAMPLES)
    own = BatchNormRecalibration(StoredSource(store), SIZE, CPU).of(generator)
    assert not own.training
    norms = [m for m in own.modules() if isinstance(m, nn.BatchNorm2d)]
    seen: dict[nn.Module, torch.Tensor] = {}
    for norm in norms:
        norm.register_forward_hook(lambda m, _, output: seen.update({m: output}))
    samples = encode_batch(store.read("train", range(SAMPLES)), store.scene, 32)
    with torch.no_grad():
        own(samples.inputs)
    assert len(seen) == len(norms) > 10
    for norm in norms:
        plain = (seen[norm] - norm.bias[:, None, None]) / norm.weight[:, None, None]
        assert plain.mean((0, 2, 3)).abs().max() < 0.02
        assert (plain.std((0, 2, 3)) - 1).abs().max() < 0.02


def test_nothing_else_changes(generator: GeneratorNetwork, store: SampleStore) -> None:
    before = copy.deepcopy(generator.state_dict())
    own = BatchNormRecalibration(StoredSource(store), SIZE, CPU).of(generator)
    for name, value in own.state_dict().items():
        assert torch.equal(generator.state_dict()[name], before[name])
        if "running" not in name and "num_batches" not in name:
            assert torch.equal(value, before[name])
    momenta = [m.momentum for m in own.modules() if isinstance(m, nn.BatchNorm2d)]
    assert set(momenta) == {0.1}


@pytest.mark.parametrize("decay", [0.9, 0.0])
def test_averaged_weights_are_shipped_with_their_own(
    decay: float, store: SampleStore, scene: Scene, tmp_path: Path
) -> None:
    options = replace(RECIPE, one_stage=True, average_decay=decay)
    run = replace(plan(store, tmp_path, interval=1e9), options=options, budget=Budget(samples=32))
    train(run)
    schedule = Schedule(run.size, options, scene, CPU)
    load_stage(tmp_path, schedule.stages["joint"])
    trained = schedule.generator()
    if decay:
        trained = BatchNormRecalibration(run.source, run.size, CPU).of(trained)
    _, shipped = load_model(tmp_path)
    for name, value in statistics_of(trained).items():
        # Shipped in half precision.
        torch.testing.assert_close(shipped.state_dict()[name], value, rtol=1e-3, atol=1e-4)
