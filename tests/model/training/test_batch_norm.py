import copy
from dataclasses import replace

import pytest
import torch
from lively import SIZE, lively_network
from torch import nn
from training_runs import RECIPE, plan

from model.networks.checkpoint import load_model
from model.training.batch import encode_batch
from model.training.monitor import NORM_SAMPLES, BatchNormRecalibration
from model.training.options import Budget
from model.training.sources import StoredSource
from model.training.stages import Schedule
from model.training.state import load_stage
from model.training.trainer import train

CPU = torch.device("cpu")


def statistics_of(network):
    return {k: v for k, v in network.state_dict().items() if "running" in k}


@pytest.fixture
def generator():
    return lively_network().eval()


def test_layers_put_out_mean_0_and_variance_1(generator, store, monkeypatch):
    # In one batch: of several, each would be drawn with its own mean.
    monkeypatch.setattr("model.training.monitor.NORM_BATCH", NORM_SAMPLES)
    before = copy.deepcopy(generator.state_dict())
    own = BatchNormRecalibration(StoredSource(store), SIZE, CPU).of(generator)
    assert not own.training
    # Nothing else changes.
    for name, value in own.state_dict().items():
        assert torch.equal(generator.state_dict()[name], before[name])
        assert "running" in name or "num_batches" in name or torch.equal(value, before[name])
    norms = [m for m in own.modules() if isinstance(m, nn.BatchNorm2d)]
    seen = {}
    for norm in norms:
        norm.register_forward_hook(lambda m, _, output: seen.update({m: output}))
    samples = encode_batch(store.read("train", range(NORM_SAMPLES)), store.scene, 32)
    with torch.no_grad():
        own(samples.inputs)
    assert len(seen) == len(norms) > 10
    for norm in norms:
        plain = (seen[norm] - norm.bias[:, None, None]) / norm.weight[:, None, None]
        assert plain.mean((0, 2, 3)).abs().max() < 0.02
        assert (plain.std((0, 2, 3)) - 1).abs().max() < 0.02


def test_averaged_weights_are_shipped_with_their_own(store, scene, tmp_path):
    options = replace(RECIPE, one_stage=True, average_decay=0.9)
    run = replace(plan(store, tmp_path, interval=1e9), options=options, budget=Budget(samples=32))
    train(run)
    schedule = Schedule(run.size, options, scene, CPU)
    load_stage(tmp_path, schedule.stages["joint"])
    trained = BatchNormRecalibration(run.source, run.size, CPU).of(schedule.generator())
    _, shipped = load_model(tmp_path)
    for name, value in statistics_of(trained).items():
        # Shipped in half precision.
        torch.testing.assert_close(shipped.state_dict()[name], value, rtol=1e-3, atol=1e-4)
