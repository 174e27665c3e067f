from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from model.errors import TrainingError
from model.training import plan as precision
from model.training.options import Budget, TrainingOptions, halvings_of_epochs, samples_of_epochs
from model.training.plan import choose_precision
from model.training.stage import cosine_decay, halving_decay


def test_a_budget_is_spent_in_its_own_unit():
    assert Budget(minutes=2.0).spent(seconds=30.0, samples=10**9) == 0.25
    assert Budget(samples=200).spent(seconds=1e9, samples=50) == 0.25


@pytest.mark.parametrize(
    ("minutes", "samples"), [(None, None), (1.0, 1), (0.0, None), (None, -5), (float("nan"), None)]
)
def test_impossible_budgets_are_refused(minutes, samples):
    with pytest.raises(TrainingError):
        Budget(minutes, samples)


def test_settings_change_single_options():
    changed = TrainingOptions().with_settings(
        ["l1_weight=50", "joint.learning_rate = 5e-4", "joint.batch_size=8", "kaiming_init=false"]
    )
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


def test_the_papers_run_sees_each_image_thirty_times_in_each_stage():
    assert samples_of_epochs(30, 200_000, TrainingOptions.faithful()) == 2 * 30 * 200_000
    assert samples_of_epochs(1, 500, TrainingOptions()) == 500
    assert samples_of_epochs(0.001, 10, TrainingOptions.faithful()) == 1


@pytest.mark.parametrize("epochs", [30.0, 12.0])
def test_rates_halve_every_five_and_eight_passes_however_many_there_are(epochs):
    options = TrainingOptions.faithful().with_settings(halvings_of_epochs(epochs))
    assert epochs != 30 or options == TrainingOptions.faithful()
    for done in range(int(epochs)):
        # In the middle of a pass, so that rounding decides nothing.
        progress = (done + 0.5) / epochs
        assert halving_decay(progress, options.opacity.halvings) == 0.5 ** (done // 5)
        assert halving_decay(progress, options.translation.halvings) == 0.5 ** (done // 8)


def test_the_cosine_rises_and_falls_like_torchs_own_schedules():
    steps = 1000
    weight = nn.Parameter(torch.zeros(1))
    optimizer = torch.optim.SGD([weight], lr=1.0)
    warm = int(0.03 * steps)
    schedule = torch.optim.lr_scheduler.SequentialLR(
        optimizer,
        [
            torch.optim.lr_scheduler.LinearLR(optimizer, 1e-9, 1.0, warm),
            torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps - warm),
        ],
        [warm],
    )
    expected = []
    for _ in range(steps):
        expected.append(optimizer.param_groups[0]["lr"])
        optimizer.step()
        schedule.step()
    ours = [cosine_decay(step / steps) for step in range(steps)]
    np.testing.assert_allclose(ours, expected, atol=1.1e-3)
    assert all(0 < cosine_decay(progress) <= 1 for progress in (0.0, 0.5, 1.0, 7.0))


CPU = torch.device("cpu")


@pytest.mark.parametrize(
    ("seconds", "faster"),
    [
        # The first step is not counted, nor what other work does to a single one.
        ({"bfloat16": [9.0, 0.9, 0.5, 0.6, 0.6], "float32": [1.0, 0.8, 0.8, 0.8, 0.8]}, "bfloat16"),
        ({"bfloat16": [1.0, 0.8, 0.8, 0.8, 0.8], "float32": [1.0, 1.5, 0.7, 0.8, 0.8]}, "float32"),
        # Emulated: one of its steps is enough.
        ({"bfloat16": [1.0, 7.0], "float32": [1.0, 0.8]}, "float32"),
    ],
)
def test_the_faster_one_is_chosen_and_measured_once(seconds, faster, monkeypatch, tmp_path):
    monkeypatch.setattr("model.measurements.cache_folder", lambda: tmp_path)
    timed = []

    def steps(kind):
        timed.append(kind)
        yield from seconds[kind]

    monkeypatch.setattr(precision, "step_seconds", steps)
    assert [choose_precision(CPU), choose_precision(CPU)] == [faster, faster]
    assert timed == ["bfloat16", "float32"]
    assert choose_precision(CPU, "bfloat16") == "bfloat16"
