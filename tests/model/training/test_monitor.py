import copy
import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch
from lively import SIZE, lively_network
from torch import nn
from training_runs import RECIPE, plan

from model.networks.checkpoint import load_model
from model.training.batch import encode_batch
from model.training.monitor import (
    LATEST_START,
    NORM_SAMPLES,
    PATIENCE,
    WARM_UP,
    BatchNormRecalibration,
    CollapseGuard,
    diversity,
    latent_health,
)
from model.training.options import Budget, StageOptions, TrainingOptions
from model.training.sources import StoredSource
from model.training.stage import StepResult
from model.training.stages import Schedule
from model.training.state import load_stage
from model.training.trainer import train

SETTINGS = TrainingOptions(adversarial_start=0.5)
JOINT = SimpleNamespace(name="joint", stage=StageOptions(8, 8e-4, 3), options=SETTINGS)
HEALTHY = {"latent_spread": 1.0, "latent_rank": 5.0, "diversity": 0.9}
ALIKE = {**HEALTHY, "diversity": 0.01}
ONE_CODE = {**HEALTHY, "latent_spread": 1e-6}


def test_independent_dimensions_have_full_rank_and_copies_rank_one():
    torch.manual_seed(0)
    codes = torch.randn(20000, 8)
    assert latent_health(codes)["latent_rank"] == pytest.approx(8.0, abs=0.02)
    assert latent_health(codes[:, :1].expand(-1, 8))["latent_rank"] == pytest.approx(1.0, abs=1e-6)
    # Two dimensions with variances 3 and 1: the entropy of (3/4, 1/4).
    pair = codes[:, :2] * torch.tensor([math.sqrt(3.0), 1.0])
    entropy = -(0.75 * math.log(0.75) + 0.25 * math.log(0.25))
    assert latent_health(pair)["latent_rank"] == pytest.approx(math.exp(entropy), rel=0.01)
    assert latent_health(pair)["latent_spread"] == pytest.approx(math.sqrt(3), rel=0.02)
    # Equal codes are measured without NaN.
    assert latent_health(torch.full((10, 8), 0.3))["latent_spread"] < 1e-6
    for codes in (torch.full((10, 8), 0.3), torch.randn(10, 1)):
        assert all(map(math.isfinite, latent_health(codes).values()))


def test_diversity_compares_with_the_rendered_images():
    torch.manual_seed(0)
    truth = torch.randn(64, 3, 8, 8)
    assert diversity(truth, truth) == pytest.approx(1)
    assert diversity(0.3 * truth + 5, truth) == pytest.approx(0.3, rel=1e-4)
    assert diversity(truth[:1].expand(64, -1, -1, -1), truth) < 1e-6
    assert math.isfinite(diversity(truth, torch.zeros_like(truth)))


@pytest.mark.parametrize(("bad", "words"), [(ALIKE, "alike"), (ONE_CODE, "codes of all")])
def test_only_a_lasting_collapse_ends_a_run(bad, words):
    guard = CollapseGuard()
    assert guard.check_measurement(JOINT, HEALTHY, WARM_UP) is None
    assert guard.check_measurement(JOINT, bad, WARM_UP - 1) is None
    assert guard.healthy
    for _ in range(PATIENCE - 1):
        assert guard.check_measurement(JOINT, bad, WARM_UP) is None
        assert not guard.healthy
    assert guard.check_measurement(JOINT, HEALTHY, WARM_UP) is None
    assert guard.healthy
    for _ in range(PATIENCE - 1):
        assert guard.check_measurement(JOINT, bad, WARM_UP) is None
    said = guard.check_measurement(JOINT, bad, WARM_UP)
    assert said is not None and words in said.what


@pytest.mark.parametrize("bad", [ALIKE, ONE_CODE])
def test_what_has_not_left_its_start_is_given_time(bad):
    guard = CollapseGuard()
    for steps in range(0, LATEST_START, 100):
        assert guard.check_measurement(JOINT, bad, steps) is None
        assert guard.healthy
    for _ in range(PATIENCE - 1):
        assert guard.check_measurement(JOINT, bad, LATEST_START) is None
    assert guard.check_measurement(JOINT, bad, LATEST_START) is not None
    # The next stage has a start of its own.
    other = SimpleNamespace(**{**vars(JOINT), "name": "translation"})
    guard = CollapseGuard()
    guard.check_measurement(JOINT, HEALTHY, LATEST_START)
    assert guard.check_measurement(other, bad, WARM_UP) is None and guard.healthy


@pytest.mark.parametrize("start", [0.0, 0.5, 0.9, 1.0])
def test_what_is_advised_can_be_done_and_makes_a_difference(start):
    options = replace(SETTINGS, adversarial_start=start)
    stage = SimpleNamespace(**{**vars(JOINT), "options": options})
    said = [
        CollapseGuard().check_measurement(stage, ALIKE, WARM_UP, last=True),
        CollapseGuard().check_measurement(stage, ONE_CODE, WARM_UP, last=True),
        CollapseGuard().check_step(stage, StepResult({"l1": math.nan}, 1.0)),
    ]
    settings = [trouble.setting for trouble in said if trouble is not None]
    assert len(settings) == 3
    for setting in settings:
        changed = options.with_settings([setting])
        assert changed != options
        assert changed.adversarial_start >= start
        assert changed.joint.learning_rate <= options.joint.learning_rate
        assert changed.decoded_tf_weight >= options.decoded_tf_weight
    assert ("adversarial_start" in settings[0]) == (start < 0.8)


@pytest.mark.parametrize(
    ("loss", "gradient", "words"),
    [(math.nan, 1.0, "the l1 loss"), (math.inf, 1.0, "the l1 loss"), (1.0, math.inf, "gradient")],
)
def test_what_is_not_finite_is_named(loss, gradient, words):
    said = CollapseGuard().check_step(JOINT, StepResult({"l1": loss}, gradient))
    assert said is not None and words in said.what
    assert CollapseGuard().check_step(JOINT, StepResult({"l1": 1.0}, 1.0)) is None


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
