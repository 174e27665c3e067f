"""What watches over training: options, precision, collapses, recorded steps."""

import copy
import math
from dataclasses import replace
from types import SimpleNamespace

import pytest
import torch
from lively import SIZE, lively_network
from torch import nn
from training_runs import RECIPE, plan

from model.errors import TrainingError
from model.networks.checkpoint import load_model
from model.networks.generator_network import EncodedInputs
from model.networks.size import NetworkSize
from model.scene.scene import Scene
from model.training import monitor
from model.training.batch import EncodedBatch, encode_batch
from model.training.options import Budget, StageOptions, TrainingOptions, halvings_of_epochs
from model.training.plan import choose_precision
from model.training.sources import StoredSource
from model.training.stage import FIRST_PASSES, StepResult, halving_decay
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
    assert monitor.latent_health(codes)["latent_rank"] == pytest.approx(8.0, abs=0.02)
    copies = monitor.latent_health(codes[:, :1].expand(-1, 8))
    assert copies["latent_rank"] == pytest.approx(1.0, abs=1e-6)
    # Two dimensions with variances 3 and 1: the entropy of (3/4, 1/4).
    pair = codes[:, :2] * torch.tensor([math.sqrt(3.0), 1.0])
    entropy = -(0.75 * math.log(0.75) + 0.25 * math.log(0.25))
    assert monitor.latent_health(pair)["latent_rank"] == pytest.approx(math.exp(entropy), rel=0.01)
    assert monitor.latent_health(pair)["latent_spread"] == pytest.approx(math.sqrt(3), rel=0.02)
    # Equal codes are measured without NaN.
    assert monitor.latent_health(torch.full((10, 8), 0.3))["latent_spread"] < 1e-6
    for codes in (torch.full((10, 8), 0.3), torch.randn(10, 1)):
        assert all(map(math.isfinite, monitor.latent_health(codes).values()))


def test_diversity_compares_with_the_rendered_images():
    torch.manual_seed(0)
    truth = torch.randn(64, 3, 8, 8)
    assert monitor.diversity(truth, truth) == pytest.approx(1)
    assert monitor.diversity(0.3 * truth + 5, truth) == pytest.approx(0.3, rel=1e-4)
    assert monitor.diversity(truth[:1].expand(64, -1, -1, -1), truth) < 1e-6
    assert math.isfinite(monitor.diversity(truth, torch.zeros_like(truth)))


@pytest.mark.parametrize(("bad", "words"), [(ALIKE, "alike"), (ONE_CODE, "codes of all")])
def test_only_a_lasting_collapse_ends_a_run(bad, words):
    guard = monitor.CollapseGuard()
    assert guard.check_measurement(JOINT, HEALTHY, monitor.WARM_UP) is None
    assert guard.check_measurement(JOINT, bad, monitor.WARM_UP - 1) is None
    assert guard.healthy
    for _ in range(monitor.PATIENCE - 1):
        assert guard.check_measurement(JOINT, bad, monitor.WARM_UP) is None
        assert not guard.healthy
    assert guard.check_measurement(JOINT, HEALTHY, monitor.WARM_UP) is None
    assert guard.healthy
    for _ in range(monitor.PATIENCE - 1):
        assert guard.check_measurement(JOINT, bad, monitor.WARM_UP) is None
    said = guard.check_measurement(JOINT, bad, monitor.WARM_UP)
    assert said is not None and words in said.what


@pytest.mark.parametrize("bad", [ALIKE, ONE_CODE])
def test_what_has_not_left_its_start_is_given_time(bad):
    guard = monitor.CollapseGuard()
    for steps in range(0, monitor.LATEST_START, 100):
        assert guard.check_measurement(JOINT, bad, steps) is None
        assert guard.healthy
    for _ in range(monitor.PATIENCE - 1):
        assert guard.check_measurement(JOINT, bad, monitor.LATEST_START) is None
    assert guard.check_measurement(JOINT, bad, monitor.LATEST_START) is not None
    # The next stage has a start of its own.
    other = SimpleNamespace(**{**vars(JOINT), "name": "translation"})
    guard = monitor.CollapseGuard()
    guard.check_measurement(JOINT, HEALTHY, monitor.LATEST_START)
    assert guard.check_measurement(other, bad, monitor.WARM_UP) is None and guard.healthy


@pytest.mark.parametrize(
    ("loss", "gradient", "words"),
    [(math.nan, 1.0, "the l1 loss"), (math.inf, 1.0, "the l1 loss"), (1.0, math.inf, "gradient")],
)
def test_what_is_not_finite_is_named(loss, gradient, words):
    said = monitor.CollapseGuard().check_step(JOINT, StepResult({"l1": loss}, gradient))
    assert said is not None and words in said.what
    assert monitor.CollapseGuard().check_step(JOINT, StepResult({"l1": 1.0}, 1.0)) is None


CPU = torch.device("cpu")


def test_layers_put_out_mean_0_and_variance_1(store, monkeypatch):
    generator = lively_network().eval()
    # In one batch: of several, each would be drawn with its own mean.
    monkeypatch.setattr("model.training.monitor.NORM_BATCH", monitor.NORM_SAMPLES)
    before = copy.deepcopy(generator.state_dict())
    own = monitor.BatchNormRecalibration(StoredSource(store), SIZE, CPU).of(generator)
    assert not own.training
    # Nothing else changes.
    for name, value in own.state_dict().items():
        assert torch.equal(generator.state_dict()[name], before[name])
        assert "running" in name or "num_batches" in name or torch.equal(value, before[name])
    norms = [m for m in own.modules() if isinstance(m, nn.BatchNorm2d)]
    seen = {}
    for norm in norms:
        norm.register_forward_hook(lambda m, _, output: seen.update({m: output}))
    samples = encode_batch(store.read("train", range(monitor.NORM_SAMPLES)), store.scene, 32)
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
    trained = monitor.BatchNormRecalibration(run.source, run.size, CPU).of(schedule.generator())
    _, shipped = load_model(tmp_path)
    for name, value in trained.state_dict().items():
        if "running" in name:
            # Shipped in half precision.
            torch.testing.assert_close(shipped.state_dict()[name], value, rtol=1e-3, atol=1e-4)


def test_settings_change_single_options():
    settings = "l1_weight=50|joint.learning_rate = 5e-4|joint.batch_size=8|kaiming_init=false"
    changed = TrainingOptions().with_settings(settings.split("|"))
    expected = replace(
        TrainingOptions(),
        l1_weight=50.0,
        joint=replace(TrainingOptions().joint, learning_rate=5e-4, batch_size=8),
        kaiming_init=False,
    )
    assert changed == expected


NONSENSE = {
    "l2_weight=1": "no 'l2_weight'; it has.*joint.batch_size",
    "joint=3": "no 'joint'",
    "joint.rate=3": "no 'joint.rate'",
    "l1_weight.x=3": "no 'l1_weight.x'",
    "l1_weight=many": "give a number, as now 150",
    "l1_weight": "give a number",
    "l1_weight=nan": "give a number",
    "joint.batch_size=2.5": "give a number, as now 32",
    "kaiming_init=1": "true or false",
    "average_decay=2": "from 0 to below 1",
    "joint.batch_size=1": "at least 2",
    "joint.learning_rate=0": "above 0",
    "joint.halvings=-1": "not be negative",
}
IMPOSSIBLE = ["adversarial_start=2", "opacity_time_share=0", "beta2=1", "unrendered_tfs=-1"]


@pytest.mark.parametrize("setting", [*NONSENSE, *IMPOSSIBLE, "l1_weight=-1"])
def test_settings_that_make_no_sense_are_refused(setting):
    with pytest.raises(TrainingError, match=NONSENSE.get(setting, ".")):
        TrainingOptions().with_settings([setting])


@pytest.mark.parametrize("epochs", [30.0, 12.0])
def test_rates_halve_every_five_and_eight_passes_however_many_there_are(epochs):
    options = TrainingOptions.faithful().with_settings(halvings_of_epochs(epochs))
    assert epochs != 30 or options == TrainingOptions.faithful()
    for done in range(int(epochs)):
        # In the middle of a pass, so that rounding decides nothing.
        progress = (done + 0.5) / epochs
        assert halving_decay(progress, options.opacity.halvings) == 0.5 ** (done // 5)
        assert halving_decay(progress, options.translation.halvings) == 0.5 ** (done // 8)


@pytest.mark.parametrize(("name", "faster"), [("amx_bf16", "bfloat16"), ("avx2", "float32")])
def test_bfloat16_is_for_processors_with_instructions_for_it(name, faster, monkeypatch):
    monkeypatch.setattr(torch.cpu, "get_capabilities", lambda: {name: True, "avx512_bf16": False})
    assert choose_precision(CPU) == faster
    assert choose_precision(CPU, "bfloat16") == "bfloat16"


NOWHERE = Scene("none", "", (0.0, 1.0), (0.0, 1.0), 32)
MODULATED = NetworkSize(0.125, 16, 32, modulation=True, deep_codec=True)


def losses_of_steps(device, recorded, count):
    options = TrainingOptions().with_settings(["unrendered_tfs=4", "small_time_share=0"])
    stage = Schedule(MODULATED, options, NOWHERE, device).stages["joint"]
    stage.recorded = recorded
    random = torch.Generator().manual_seed(1)

    def draw(*shape):
        return (2 * torch.rand(8, *shape, generator=random) - 1).to(device)

    found = []
    for number in range(count):
        inputs = EncodedInputs(draw(5), draw(256), draw(3, 256))
        batch = EncodedBatch(inputs, draw(1, 16, 16), draw(3, 32, 32))
        found.append(stage.step(batch, number / count).losses)
    assert stage.steps == count
    return found


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs an NVIDIA GPU")
def test_recorded_steps_learn_what_others_do():
    device = torch.device("cuda")
    count = FIRST_PASSES + 3
    losses = (losses_of_steps(device, is_recorded, count) for is_recorded in (False, True))
    for plain, recorded in zip(*losses, strict=True):
        # The random TFs, the rate and the batch are each step's own; sums differ in their order.
        assert recorded == pytest.approx(plain, rel=0.02)


def test_the_losses_of_a_pass_are_those_of_a_step(monkeypatch):
    """Without a GPU: the pass as it would be recorded, made anew each time."""
    name = "model.training.stage.RecordedPass.run"
    monkeypatch.setattr(name, lambda self, batch: self._run(batch))
    device = torch.device("cpu")
    plain = losses_of_steps(device, False, 5)
    for one, other in zip(plain, losses_of_steps(device, True, 5), strict=True):
        # Some processors add up in another order.
        assert other == pytest.approx(one, rel=1e-3)
